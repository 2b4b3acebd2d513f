"""The operating system: what it is called, what it has and what it lacks; nothing else asks which it is."""

import errno
import importlib
import os
import platform
import shlex
import signal
import stat
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import IO, Any, ClassVar

STEP = 0.1
"""Seconds between two tries of what the system cannot wait for."""


class OperatingSystem:
    """Linux, and whatever is like it; the classes below say how other systems differ."""

    compilers: ClassVar[tuple[str, ...]] = ("cc", "gcc", "clang")
    """What C compilers are called, the first that is there first."""
    install: ClassVar[str] = (
        "install the package gcc (Debian, Ubuntu: apt install gcc; Fedora: dnf install gcc) or point CC to "
        "one"
    )
    library: ClassVar[str] = ".so"
    """How the names of shared libraries end."""
    keeps_open_files: ClassVar[bool] = False
    """Whether a file, and the folder that it is in, keeps its name for as long as somebody has it open."""
    stack: ClassVar[int] = 5_000_000
    """Bytes of a thread's stack that C may take; linkwise makes none that takes more."""
    patience: ClassVar[float] = 0.0
    """Seconds for which a rename that an open file holds up is tried again."""

    @property
    def forks(self) -> bool:
        """Whether a fork of this process can compute."""
        return hasattr(os, "fork")

    def cache_home(self) -> Path:
        """Where programs keep what they can make again; raises RuntimeError for a user without a home."""
        shared = os.environ.get("XDG_CACHE_HOME", "")
        # A relative one is void, by the rules that XDG stands for.
        return Path(shared) if os.path.isabs(shared) else self._own_cache_home()

    def _own_cache_home(self) -> Path:
        return Path.home() / ".cache"

    def user(self) -> int:
        """Number of this user, as `os.stat` has it of a file's owner."""
        return os.geteuid()

    def others_may_write(self, mode: int) -> bool:
        """Whether the mode of a file or a folder lets other users change it."""
        return bool(mode & (stat.S_IWGRP | stat.S_IWOTH))

    def lock(self, descriptor: int, wait: bool = False) -> bool:
        """Lock an open file until it is closed; False where another has it. Raises OSError, ImportError."""
        import fcntl

        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        except BlockingIOError:
            return False
        return True

    def flush(self, path: Path) -> None:
        """Have the disk hold a file, or the list of a folder's entries; raises OSError."""
        self._flush(os.open(path, os.O_RDONLY))

    def _flush(self, descriptor: int) -> None:
        try:
            os.fsync(descriptor)
        except OSError as error:
            if error.errno != errno.EINVAL:  # a file system that has nothing to flush
                raise
        finally:
            os.close(descriptor)

    def moved(self, move: Callable[[Path], object], there: Path) -> None:
        """Rename or replace; once more for a while where open files, a scanner's say, hold it up."""
        end = time.monotonic() + self.patience
        while True:
            try:
                move(there)
                return
            except PermissionError:
                if time.monotonic() >= end:
                    raise
                time.sleep(STEP)

    def words(self, command: str) -> list[str]:
        """Words of a command line; raises ValueError where a quotation mark is missing."""
        return shlex.split(command)

    def outlet(self) -> int | IO[bytes]:
        """What a program is to write to: see `hear`. Raises OSError."""
        return subprocess.PIPE

    def listen(self, stream: IO[bytes]) -> None:
        """Make ready for `hear`."""
        os.set_blocking(stream.fileno(), False)

    def hear(self, stream: IO[bytes], said: bytearray, ended: bool) -> None:
        """Add to `said` what a program, that may have ended, has written to a stream by now."""
        said.extend(stream.read() or b"")

    def stop(self, process: "subprocess.Popen[bytes]") -> None:
        """End a program that was started in a session of its own, and all that it has started."""
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)

    def processor(self) -> str:
        """What -march=native depends on."""
        try:
            lines = Path("/proc/cpuinfo").read_text().splitlines()
        except OSError:
            return platform.processor()
        return repr(sorted({line for line in lines if line.startswith(("model name", "flags", "Features"))}))


class MacOS(OperatingSystem):
    """macOS: like Linux, but for names, and for forks that its own libraries do not survive."""

    install = "install Apple's (xcode-select --install) or point CC to one"
    forks = False

    def _own_cache_home(self) -> Path:
        return Path.home() / "Library/Caches"

    def processor(self) -> str:
        """What -march=native depends on."""
        asked = ["sysctl", "-n", "machdep.cpu.brand_string"]
        with suppress(OSError):
            return subprocess.run(asked, capture_output=True, check=False).stdout.decode(errors="replace")
        return platform.processor()


class Windows(OperatingSystem):
    """Windows: who may write where is not told by modes, and what is open keeps its name."""

    compilers = ("gcc", "clang", "cc", "clang-cl", "cl")
    install = (
        "install gcc of MinGW-w64 (winget install BrechtSanders.WinLibs.POSIX.UCRT, then open a new console) "
        "or point CC to one"
    )
    library = ".dll"
    keeps_open_files = True
    stack = 1_500_000
    patience = 1.0
    forks = False

    def cache_home(self) -> Path:
        """The user's own part of the machine's data, which Windows closes to other users."""
        local = os.environ.get("LOCALAPPDATA", "")
        return Path(local) if os.path.isabs(local) else Path.home() / "AppData/Local"

    def user(self) -> int:
        """Number of this user, as `os.stat` has it of every file's owner here."""
        return 0

    def others_may_write(self, mode: int) -> bool:
        """Nothing that a mode tells here."""
        return False

    def lock(self, descriptor: int, wait: bool = False) -> bool:
        """Lock the first byte of an open file until it is closed; False where another has it."""
        msvcrt: Any = importlib.import_module("msvcrt")
        while True:
            os.lseek(descriptor, 0, os.SEEK_SET)
            try:
                msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
            except PermissionError:
                if not wait:
                    return False
            else:
                return True
            time.sleep(STEP)

    def flush(self, path: Path) -> None:
        """Have the disk hold a file, which must be open to be written; folders are Windows' own matter."""
        if not path.is_dir():
            self._flush(os.open(path, os.O_RDWR | getattr(os, "O_BINARY", 0)))

    def words(self, command: str) -> list[str]:
        """Words of a command line in which backslashes are those of paths."""
        return [word.strip('"') for word in shlex.split(command, posix=False)]

    def outlet(self) -> int | IO[bytes]:
        """A file without a name: pipes there can only be waited for."""
        return tempfile.TemporaryFile()

    def listen(self, stream: IO[bytes]) -> None:
        """Nothing is to be made ready."""

    def hear(self, stream: IO[bytes], said: bytearray, ended: bool) -> None:
        """Add to `said` what a program has written, once it has ended: both write and read at one place."""
        if ended and not said:
            stream.seek(0)
            said.extend(stream.read())

    def stop(self, process: "subprocess.Popen[bytes]") -> None:
        """End a program, and all that it has started."""
        with suppress(OSError):
            tree = ["taskkill", "/T", "/F", "/PID", str(process.pid)]
            subprocess.run(tree, capture_output=True, check=False)
        with suppress(OSError):
            process.kill()

    def processor(self) -> str:
        """What Windows says of it."""
        return platform.processor()


def system_here() -> OperatingSystem:
    """The system that this Python runs on."""
    here: type[OperatingSystem] = {"win32": Windows, "darwin": MacOS}.get(sys.platform, OperatingSystem)
    return here()
