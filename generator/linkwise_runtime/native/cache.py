"""The directory that keeps compiled libraries: who may write there, and whether a library is still whole.

A library that another user can change would run as this user, and a truncated library crashes the
interpreter that calls it. So the directory must belong to this user, or to root, and be closed to others, as
far as the system reports; beside each library lies the hash of its bytes, which are read and compared before
the library is loaded.
"""

import errno
import hashlib
import os
import stat
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from io import BufferedReader
from pathlib import Path

from .system import STEP, system_here

ELSEWHERE = "set LINKWISE_CACHE to another directory"
SAFELY = sum(getattr(os, flag, 0) for flag in ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC", "O_BINARY"))
"""Flags to open a file that another user may have planted: as far as the system can, no link is followed."""
NOT_OWN = "it is not a plain file of your own; remove it"


def cache_directory() -> Path:
    """Return LINKWISE_CACHE, or linkwise in the user's cache directory; made if need be.

    Raises RuntimeError where it cannot be made, and where another user may write to it.
    """
    path = _chosen_directory()
    try:
        path.mkdir(mode=0o700, parents=True, exist_ok=True)
        path = path.resolve()  # a link may point elsewhere later
        found = path.stat()
    except OSError as error:
        raise RuntimeError(f"cannot make the cache {path}: {error.strerror}; {ELSEWHERE}") from None
    if found.st_uid not in _trusted():
        raise RuntimeError(f"the cache {path} belongs to another user; {ELSEWHERE}, one of your own")
    if system_here().others_may_write(found.st_mode):
        raise RuntimeError(f"other users may write to the cache {path}; chmod go-w it, or {ELSEWHERE}")
    return path


def _chosen_directory() -> Path:
    given = os.environ.get("LINKWISE_CACHE")
    if given:
        return Path(given).absolute()
    try:
        return system_here().cache_home() / "linkwise"
    except RuntimeError:
        raise RuntimeError("no home directory to keep compiled code in; set LINKWISE_CACHE") from None


def is_whole(library: Path) -> bool:
    """Return whether no other user may change a library's file, and its bytes have the stored hash."""
    try:
        with _opened(library) as file, _opened(_digest_of(library)) as digest:
            closed = not system_here().others_may_write(os.fstat(file.fileno()).st_mode)
            return closed and hashlib.file_digest(file, "sha256").hexdigest().encode() == digest.read(65)
    except OSError:
        return False


def keep(made: Path, library: Path) -> None:
    """Move a library, made on the same disk, to its place, and the hash of its bytes beside it."""
    digest = made.with_suffix(".sha256")
    with made.open("rb") as file:
        digest.write_text(hashlib.file_digest(file, "sha256").hexdigest(), encoding="ascii")
    made.chmod(0o644)
    # A process that looks in between finds a hash that does not fit, waits for the lock, and looks again.
    system_here().moved(digest.replace, _digest_of(library))
    system_here().moved(made.replace, library)


@contextmanager
def locked(path: Path, tell: Callable[[str], None]) -> Iterator[None]:
    """Keep other processes out while one builds; the lock ends with the process that holds it.

    `tell` is called where another process holds it. Raises RuntimeError if no lock is possible.
    """
    system = system_here()
    with ExitStack() as held:
        try:
            file = held.enter_context(_opened(path, os.O_RDWR | os.O_CREAT))
            while not system.lock(file.fileno()):
                tell("another process is at it")
                time.sleep(STEP)
        except OSError as error:
            raise RuntimeError(f"cannot lock {path}: {error.strerror}; {ELSEWHERE}") from None
        yield


def _opened(path: Path, flags: int = os.O_RDONLY) -> BufferedReader:
    """Open a plain file of a trusted user; raise OSError for another user's file, a link or a pipe."""
    try:
        descriptor = os.open(path, flags | SAFELY, 0o600)
    except OSError as error:
        raise (OSError(error.errno, NOT_OWN) if error.errno == errno.ELOOP else error) from None
    found = os.fstat(descriptor)
    if not stat.S_ISREG(found.st_mode) or found.st_uid not in _trusted():
        os.close(descriptor)
        raise OSError(errno.EPERM, NOT_OWN)
    return os.fdopen(descriptor, "rb")


def _digest_of(library: Path) -> Path:
    return library.with_suffix(".sha256")


def _trusted() -> tuple[int, int]:
    """Return the ids of the users whose files are trusted: this user, and root, who can do anything."""
    return system_here().user(), 0
