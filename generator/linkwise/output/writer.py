"""Writing of whole folders, and of sets of files in folders that hold others too."""

import errno
import os
import re
import shutil
import signal
import stat
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path

from linkwise_runtime.native.system import system_here

from linkwise.errors import LinkwiseError
from linkwise.input_file import kind_of
from linkwise.output.exchange import exchange, flush, publish
from linkwise.output.workplace import ENDING, NEW, REST, sweep, workplace

ADDRESS = re.compile(r"[A-Za-z][A-Za-z0-9+.-]+:(?=/|$)")
"""Pattern of an address, s3://bucket as a path has it; a drive of Windows is one letter."""


@contextmanager
def whole_directory(target: Path, refuse: Callable[[Path], None]) -> Iterator[Path]:
    """Yield a folder to write into; it becomes `target` at the end, and is removed after an error.

    `refuse` raises LinkwiseError where its argument is there and may not be replaced. LinkwiseError is raised
    too where `target` cannot be written; what was there then stays.
    """
    if target.name in ("", ".."):
        target = Path(os.path.realpath(target))
    with _ended_by_signal(), _failures_named(target):
        sweep(target.parent)
        if os.path.lexists(target):
            refuse(target)
        with _folder(target.parent), workplace(target.parent) as work:
            draft = work / NEW
            draft.mkdir()
            yield draft
            _replace(draft, target, refuse)


def write_files(directory: Path, files: Mapping[str, bytes]) -> tuple[Path, ...]:
    """Write files, by name, into a folder that may hold others, and return their paths.

    All are written, or none and LinkwiseError is raised. Each is there whole, old or new, at any moment; a
    kill between two leaves both kinds side by side.
    """
    targets = tuple(directory / name for name in files)
    with _ended_by_signal(), _failures_named(directory):
        sweep(directory)
        for target in targets:
            _refuse_unless_replaceable(target)
        with _folder(directory), workplace(directory) as work:
            for folder in (NEW, REST):
                (work / folder).mkdir()
            for name, content in files.items():
                (work / NEW / name).write_bytes(content)
            former = {target for target in targets if os.path.lexists(target)}
            for target in former:
                shutil.copy2(target, work / REST, follow_symlinks=False)
            if former:
                flush(work / NEW)
            _replace_files(work, targets, former)
    return targets


def refuse_unless_folder(target: Path, remedy: str) -> None:
    """Raise LinkwiseError where `target`, which is there, is a symbolic link or not a folder."""
    if target.is_symlink() or not target.is_dir():
        what = "a symbolic link" if target.is_symlink() else "not a folder"
        raise LinkwiseError(f"{target} is {what}; {remedy}")


def require_writable(directory: Path) -> None:
    """Raise LinkwiseError, before any work is done, where no file can be made for `directory`."""
    place = directory
    while not os.path.lexists(place) and place != place.parent:
        place = place.parent
    with _failures_named(directory), tempfile.TemporaryFile(dir=place):
        pass


def _replace(draft: Path, target: Path, refuse: Callable[[Path], None]) -> None:
    """Put `draft` in the place of `target`, unless something was added there since it was looked at."""
    if os.path.lexists(target):
        flush(draft)
    if not publish(draft, target):
        return
    try:
        refuse(draft)
        system_here().flush(target.parent)
    except (LinkwiseError, OSError):
        exchange(draft, target)
        refuse(target)  # the same, said of the right place
        raise


def _replace_files(work: Path, targets: tuple[Path, ...], former: set[Path]) -> None:
    done: list[Path] = []
    try:
        for target in targets:
            done.append(target)
            system_here().moved((work / NEW / target.name).replace, target)
    except BaseException:
        for target in done:
            if target in former:
                system_here().moved((work / REST / target.name).replace, target)
            else:
                target.unlink(missing_ok=True)
        raise


def _refuse_unless_replaceable(target: Path) -> None:
    """Raise FileExistsError for anything but a file or a link: a copy of it may never end."""
    if not os.path.lexists(target):
        return
    mode = target.lstat().st_mode
    if target.is_dir() or not (stat.S_ISREG(mode) or stat.S_ISLNK(mode)):
        kind = "a folder" if target.is_dir() else kind_of(mode)
        raise FileExistsError(errno.EEXIST, f"{kind} of that name is there", str(target))


@contextmanager
def _folder(directory: Path) -> Iterator[None]:
    """Make a folder and those above it; after an error the new ones are removed, if they are empty."""
    missing = [place for place in (directory, *directory.parents) if not os.path.lexists(place)]
    try:
        if not directory.is_dir():
            directory.mkdir(parents=True, exist_ok=True)
        yield
    except BaseException:
        for place in missing:
            with suppress(OSError):
                place.rmdir()
        raise


@contextmanager
def _failures_named(place: Path) -> Iterator[None]:
    """Raise LinkwiseError for an OSError on the way to `place`: a full disk, above all."""
    if ADDRESS.match(place.as_posix()):
        raise LinkwiseError(f"{place}: that is an address, and results are written to folders; choose one")
    try:
        yield
    except OSError as error:
        blocker, reason, remedy = _blocker(place), error.strerror or type(error).__name__, ""
        if blocker is not None:
            place, reason = blocker, "it is not a folder"
        elif isinstance(error, FileExistsError) and error.filename:
            place, remedy = error.filename, "move it away, or "
        elif isinstance(error, PermissionError) and system_here().keeps_open_files:
            remedy = "close the programs that have files there open, or "
        raise LinkwiseError(
            f"{place}: nothing was written: {reason}; {remedy}choose another place"
        ) from error


def _blocker(place: Path) -> Path | None:
    """Return the uppermost part of a path that is there and is no folder, where one is needed; else None."""
    parts = (*reversed(place.parents), place)
    return next((part for part in parts if os.path.lexists(part) and not part.is_dir()), None)


@contextmanager
def _ended_by_signal() -> Iterator[None]:
    """Let signals that end a program end the work as an error does: what is half written is removed."""
    # Only the main thread may set handlers.
    numbers = ENDING if threading.current_thread() is threading.main_thread() else []
    own = [number for number in numbers if signal.getsignal(number) == signal.SIG_DFL]
    try:
        for number in own:
            signal.signal(number, lambda number, _: sys.exit(128 + number))
        yield
    finally:
        for number in own:
            signal.signal(number, signal.SIG_DFL)
