"""A writer's own folder beside its target: `.linkwise-XXXXXXXX`, locked for as long as the writer lives.

    lock        held locked; the system releases it with the process, on whatever machine it ran
    new         what is being written
    old/NAME    the former target, during an exchange that the file system cannot do in one step
    rest        what is about to be removed

A free lock on a folder of one's own shows that its writer is dead: NAME goes back to where it was unless
something is there again, and the folder is removed. One that holds anything else was not made by linkwise
and stays.
"""

import os
import shutil
import signal
import tempfile
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path

from linkwise_runtime.native.system import system_here

PREFIX = ".linkwise-"
RANDOM = 8
"""Number of letters that `mkdtemp` appends."""
LOCK, NEW, OLD, REST = "lock", "new", "old", "rest"
ENDING = [int(getattr(signal, name)) for name in ("SIGTERM", "SIGHUP", "SIGBREAK") if hasattr(signal, name)]
"""Signals that end a program, beside that of Ctrl-C; each system has some of them."""


@contextmanager
def workplace(parent: Path) -> Iterator[Path]:
    """Yield a new folder in `parent`, which is removed at the end with all that is in it; raises OSError."""
    held = ExitStack()
    held.enter_context(signals_held())
    try:
        work, lock = _made(parent)
    except BaseException:
        held.close()
        raise
    try:
        held.close()  # one that came meanwhile strikes here, where the folder is tidied up
        yield work
    finally:
        try:
            _cleared(work)
        except BaseException:  # a signal: tidy up all the same
            _cleared(work)
            raise
        finally:
            _left(work, lock)


@contextmanager
def passing_folder() -> Iterator[Path]:
    """Yield a new folder in the system's place for temporary files; it is removed at the end.

    After a kill it is removed by the next sweep of that place.
    """
    with workplace(Path(tempfile.gettempdir())) as work:
        (work / NEW).mkdir()
        yield work / NEW


@contextmanager
def signals_held() -> Iterator[None]:
    """Delay signals to the end of a few steps that must not be separated.

    They are blocked, for processes that begin meanwhile, and in the main thread put off as well: Python calls
    the handler there even for a signal that another thread takes.
    """
    in_main = threading.current_thread() is threading.main_thread()
    kinds = (signal.SIGINT, *ENDING) if in_main else ()
    former = {kind: handler for kind in kinds if (handler := signal.getsignal(kind)) is not None}
    came: list[int] = []
    mask = None
    try:
        for kind in former:
            signal.signal(kind, lambda number, _: came.append(number))
        if hasattr(signal, "pthread_sigmask"):
            mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, *ENDING})
        yield
    finally:
        if mask is not None:
            signal.pthread_sigmask(signal.SIG_SETMASK, mask)
        for kind in reversed(former):  # Ctrl-C's last: it may strike at once
            signal.signal(kind, former[kind])
        for number in came:
            signal.raise_signal(number)


def sweep(parent: Path) -> None:
    """Remove what dead writers left in `parent`, and put back what they had taken away.

    Nothing is raised: what cannot be done now, for example for want of a permission, is left to the next
    sweep.
    """
    with suppress(OSError), os.scandir(parent) as entries:
        found = [
            Path(entry.path)
            for entry in entries
            if entry.name.startswith(PREFIX) and len(entry.name) == len(PREFIX) + RANDOM
            if entry.is_dir(follow_symlinks=False) and _own(entry)
        ]
        for work in sorted(found):
            lock = _held(work, os.O_RDWR)
            if lock is not None:
                _cleared(work)
                _left(work, lock)
                continue
            with suppress(OSError):
                work.rmdir()  # empty: its writer died before the lock was there, or after it went


def _own(entry: "os.DirEntry[str]") -> bool:
    """Return whether this user made it: in a folder that many write to, another's could be a trap."""
    return entry.stat(follow_symlinks=False).st_uid == system_here().user()


def _made(parent: Path) -> tuple[Path, int]:
    """Make and lock a workplace; another one if somebody swept it away before the lock was held."""
    while True:
        work = Path(tempfile.mkdtemp(prefix=PREFIX, dir=parent))
        try:
            lock = _held(work, os.O_RDWR | os.O_CREAT)
        except BaseException:
            with suppress(OSError):
                work.rmdir()
            raise
        if lock is not None:
            return work, lock


def _held(work: Path, flags: int) -> int | None:
    """Open and lock a workplace, and return the lock; None where somebody else holds it, or it is gone.

    Where locks are not available, a writer goes without (its workplace is then never swept).
    """
    making = bool(flags & os.O_CREAT)
    try:
        lock = os.open(work / LOCK, flags, 0o600)
    except FileNotFoundError:
        return None
    except OSError:
        if making:
            raise
        return None
    if locked(lock, otherwise=making) and _is_at(lock, work / LOCK):
        return lock
    os.close(lock)
    return None


def locked(lock: int, otherwise: bool) -> bool:
    """Lock an open file, and return True; False where another has it, `otherwise` without locks of files.

    The lock is the runtime's, which needs no library: filelock would be a second one, and would make the
    file that `sweep` only looks for.
    """
    try:
        return system_here().lock(lock)
    except (ImportError, OSError):
        return otherwise


def _is_at(lock: int, path: Path) -> bool:
    """Return whether the open file is still the one of that name."""
    try:
        return os.path.samestat(os.fstat(lock), path.stat())
    except OSError:
        return False


def _cleared(work: Path) -> None:
    """Put back what is in `old` and empty the workplace, which is locked; errors leave it to a sweep."""
    with suppress(OSError):
        if not {LOCK, NEW, OLD, REST}.issuperset(os.listdir(work)):
            return
        if (work / OLD).is_dir():
            for former in (work / OLD).iterdir():
                with suppress(OSError):
                    former.rename(work.parent / former.name)  # fails where there is something
            # Under its own name a half-removed folder would be put back as if it were whole.
            shutil.rmtree(work / REST, ignore_errors=True)
            (work / OLD).rename(work / REST)
        for name in (NEW, REST):
            shutil.rmtree(work / name, ignore_errors=True)


def _left(work: Path, lock: int) -> None:
    """Release the lock, as open files may keep their names, and remove a workplace that has nothing else."""
    os.close(lock)
    with suppress(OSError):
        if os.listdir(work) == [LOCK]:
            (work / LOCK).unlink()
            work.rmdir()
