"""The operating system: its names, its abilities and its limits; no other module asks which system it is."""

import errno
import importlib
import os
import platform
import shlex
import signal
import stat
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, ClassVar

STEP = 0.1
"""Seconds between two tries of what the system cannot wait for."""


class OperatingSystem:
    """Linux, and systems like it; the subclasses say how other systems differ."""

    compilers: ClassVar[tuple[str, ...]] = ("cc", "gcc", "clang")
    """Names of C compilers, in the order in which they are tried."""
    install: ClassVar[str] = (
        "install the package gcc (Debian, Ubuntu: apt install gcc; Fedora: dnf install gcc) or point CC to "
        "one"
    )
    library: ClassVar[str] = ".so"
    """Ending of the names of shared libraries."""
    keeps_open_files: ClassVar[bool] = False
    """True if a file, and the folder that it is in, keeps its name while somebody has it open."""
    stack: ClassVar[int] = 5_000_000
    """Bytes of a thread's stack that C may take; linkwise makes no function that takes more."""
    patience: ClassVar[float] = 0.0
    """Seconds for which a rename is retried while an open file blocks it."""

    @property
    def forks(self) -> bool:
        """True if a fork of this process can compute."""
        return hasattr(os, "fork")

    def cache_home(self) -> Path:
        """Return the folder for files that programs can make again.

        Raises RuntimeError for a user without a home.
        """
        shared = os.environ.get("XDG_CACHE_HOME", "")
        # By the rules of XDG, a relative path is void.
        return Path(shared) if os.path.isabs(shared) else self._own_cache_home()

    def _own_cache_home(self) -> Path:
        return Path.home() / ".cache"

    def user(self) -> int:
        """Return the id of this user, as `os.stat` reports it for a file's owner."""
        return os.geteuid()

    def others_may_write(self, mode: int) -> bool:
        """Return whether the mode of a file or a folder lets other users change it."""
        return bool(mode & (stat.S_IWGRP | stat.S_IWOTH))

    def lock(self, descriptor: int) -> bool:
        """Lock an open file until it is closed; return False where another process has locked it.

        Raises OSError, ImportError.
        """
        import fcntl

        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            return False
        return True

    def flush(self, path: Path) -> None:
        """Force a file, or a folder's list of entries, to the disk; raise OSError where that fails."""
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
        """Rename or replace a file.

        It is tried again for a while where an open file, such as a virus scanner's, blocks it.
        """
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
        """Return the words of a command line; raise ValueError where a quotation mark is missing."""
        return shlex.split(command)

    def stop(self, process: "subprocess.Popen[bytes]") -> None:
        """End a program that was started in a session of its own, and all that it started."""
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)

    def processor(self) -> str:
        """Return a description of the processor, on which -march=native depends."""
        try:
            lines = Path("/proc/cpuinfo").read_text().splitlines()
        except OSError:
            return platform.processor()
        return repr(sorted({line for line in lines if line.startswith(("model name", "flags", "Features"))}))


class MacOS(OperatingSystem):
    """macOS: like Linux, but for names, and for forks, which Apple's libraries do not survive."""

    install = "install Apple's (xcode-select --install) or point CC to one"
    forks = False

    def _own_cache_home(self) -> Path:
        return Path.home() / "Library/Caches"

    def processor(self) -> str:
        """Return a description of the processor, on which -march=native depends."""
        asked = ["sysctl", "-n", "machdep.cpu.brand_string"]
        with suppress(OSError):
            return subprocess.run(asked, capture_output=True, check=False).stdout.decode(errors="replace")
        return platform.processor()


class Windows(OperatingSystem):
    """Windows: modes do not show who may write where, and an open file keeps its name."""

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
        """Return the user's own folder of local data, which Windows closes to other users."""
        local = os.environ.get("LOCALAPPDATA", "")
        return Path(local) if os.path.isabs(local) else Path.home() / "AppData/Local"

    def user(self) -> int:
        """Return 0, which `os.stat` reports here as the owner of every file."""
        return 0

    def others_may_write(self, mode: int) -> bool:
        """Return False: a mode does not show that here."""
        return False

    def lock(self, descriptor: int) -> bool:
        """Lock the first byte of an open file until it is closed; return False where another process did."""
        msvcrt: Any = importlib.import_module("msvcrt")
        os.lseek(descriptor, 0, os.SEEK_SET)
        try:
            msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)
        except PermissionError:
            return False
        return True

    def flush(self, path: Path) -> None:
        """Force a file, which must be writable, to the disk; folders are left to Windows."""
        if not path.is_dir():
            self._flush(os.open(path, os.O_RDWR | getattr(os, "O_BINARY", 0)))

    def words(self, command: str) -> list[str]:
        """Return the words of a command line in which backslashes belong to paths."""
        return [word.strip('"') for word in shlex.split(command, posix=False)]

    def stop(self, process: "subprocess.Popen[bytes]") -> None:
        """End a program, and all that it started."""
        with suppress(OSError):
            tree = ["taskkill", "/T", "/F", "/PID", str(process.pid)]
            subprocess.run(tree, capture_output=True, check=False)
        with suppress(OSError):
            process.kill()

    def processor(self) -> str:
        """Return Windows' description of the processor."""
        return platform.processor()


def system_here() -> OperatingSystem:
    """Return the system that this Python runs on."""
    here: type[OperatingSystem] = {"win32": Windows, "darwin": MacOS}.get(sys.platform, OperatingSystem)
    return here()
