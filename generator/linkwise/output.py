"""Files and folders that appear whole or not at all: the one writer of packages, reports and analyses."""

import os
import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

from linkwise.errors import LinkwiseError


@contextmanager
def whole_directory(target: Path, refuse: Callable[[Path], None]) -> Iterator[Path]:
    """Yield a folder to write into; it becomes `target` at the end, and goes after an error.

    `refuse` raises LinkwiseError where `target` is there and may not be replaced. LinkwiseError is raised
    too where `target` cannot be written; what was there then stays.
    """
    if target.exists() or target.is_symlink():
        refuse(target)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        # Beside the target, so that renaming it is one step of the file system.
        draft = Path(tempfile.mkdtemp(prefix=f".{target.name[:40]}-", dir=target.parent))
    except OSError as error:
        raise _unwritable(target, error) from error
    try:
        yield draft
        draft.chmod(0o755)
        _exchange(draft, target)
    except OSError as error:  # a full disk, above all
        raise _unwritable(target, error) from error
    finally:
        shutil.rmtree(draft, ignore_errors=True)


def write_files(directory: Path, files: Mapping[str, bytes]) -> tuple[Path, ...]:
    """Write files, by name, into a folder that may hold others: all, or none and LinkwiseError."""
    drafts: list[tuple[Path, Path]] = []
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            drafts.append((directory / f".{name}.{os.getpid()}", directory / name))
            drafts[-1][0].write_bytes(content)
        for draft, target in drafts:
            draft.replace(target)
    except OSError as error:
        raise _unwritable(directory, error) from error
    finally:
        for draft, _ in drafts:
            draft.unlink(missing_ok=True)
    return tuple(target for _, target in drafts)


def require_writable(directory: Path) -> None:
    """Raise LinkwiseError, before any work is done, where no file can be made for `directory`."""
    place = directory
    while not place.exists() and place != place.parent:
        place = place.parent
    try:
        with tempfile.TemporaryFile(dir=place):
            pass
    except OSError as error:
        raise _unwritable(directory, error) from error


@contextmanager
def ended_by_signal() -> Iterator[None]:
    """Let SIGTERM end the work as an error does: what is half written goes."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set handlers
        return
    former = signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, former)


def _exchange(draft: Path, target: Path) -> None:
    """Rename `draft` to `target`; what was there comes back if that fails."""
    if not target.exists():
        draft.rename(target)
        return
    former = draft.with_name(f"{draft.name}.former")
    target.rename(former)
    try:
        draft.rename(target)
    except OSError:
        former.rename(target)
        raise
    shutil.rmtree(former)


def _unwritable(place: Path, error: OSError) -> LinkwiseError:
    reason = error.strerror or type(error).__name__
    at = error.filename if isinstance(error, FileExistsError | NotADirectoryError) else None
    return LinkwiseError(f"{at or place}: nothing was written: {reason}; choose another place")
