"""Exchange of a finished folder for another, in one step where the system can."""

import ctypes
import errno
import os
import tempfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

from linkwise_runtime.native.system import system_here

from linkwise.output.workplace import OLD, REST

AT_CWD = -100  # AT_FDCWD of Linux
SWAP = ctypes.c_uint(2)  # RENAME_EXCHANGE of Linux, RENAME_SWAP of macOS
TRIES = 100
TAKEN = (errno.ENOTEMPTY, errno.EEXIST)


def publish(draft: Path, target: Path) -> bool:
    """Rename folder `draft`, of a workplace beside `target`, to that name; return whether one was there.

    The former folder is then at `draft`. Raises OSError; nothing has changed then.
    """
    for _ in range(TRIES):  # another writer may put its own there, or be between its two renames
        try:
            system_here().moved(draft.rename, target)  # over nothing or, where it can be, an empty folder
            return False
        except OSError as error:
            if error.errno not in TAKEN:
                raise
        try:
            exchange(draft, target)
            return True
        except OSError as error:
            if error.errno not in (errno.ENOENT, *TAKEN):
                raise
    raise OSError(errno.EBUSY, "others keep writing there")


def exchange(draft: Path, target: Path) -> None:
    """Exchange two folders; raises OSError, and then nothing has changed.

    Without the system's help they are renamed one by one, and a kill in between leaves the former target in
    the workplace, from where `workplace.sweep` brings it back.
    """
    if _swapped(draft, target):
        return
    former = draft.parent / OLD / target.name
    former.parent.mkdir(exist_ok=True)
    steps = ((target, former), (draft, target), (former, draft))
    done: list[tuple[Path, Path]] = []
    try:
        for here, there in steps:
            system_here().moved(here.rename, there)
            done.append((here, there))
    except OSError:
        _undo(done, former)
        raise


def _undo(done: list[tuple[Path, Path]], former: Path) -> None:
    for here, there in reversed(done):
        try:
            there.rename(here)
        except OSError as error:
            # Another writer's folder is, or just was, in the place of `former`, which is then of no more use.
            # Where all fails, `former` is where `workplace.sweep` looks for it.
            if there == former and (error.errno in TAKEN or os.path.lexists(here)):
                rest = former.parents[1] / REST
                rest.mkdir(exist_ok=True)  # a writer who came between may have come before
                former.rename(tempfile.mkdtemp(dir=rest))


def flush(folder: Path) -> None:
    """Write all that is in `folder` to the disk, so that a power cut after the exchange loses neither."""
    for place, _, names in os.walk(folder):
        for name in names:
            system_here().flush(Path(place, name))
        system_here().flush(Path(place))


def _swapped(one: Path, other: Path) -> bool:
    """Exchange two names in one step; return False where that cannot be, for whatever reason."""
    call = _swap()
    return call is not None and call(os.fsencode(one), os.fsencode(other)) == 0


@cache
def _swap() -> Callable[[bytes, bytes], int] | None:
    """Return the system's call for an exchange, if it has one."""
    try:
        library = ctypes.CDLL(None)
    except (OSError, TypeError):
        return None
    if hasattr(library, "renameat2"):
        return lambda one, other: int(library.renameat2(AT_CWD, one, AT_CWD, other, SWAP))
    if hasattr(library, "renamex_np"):
        return lambda one, other: int(library.renamex_np(one, other, SWAP))
    return None
