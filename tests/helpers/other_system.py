"""Runs a program as on another system, as far as Linux can be made to lack what that lacks.

    python other_system.py windows|macos [--core] PROGRAM ARGUMENT...

Windows here has neither fcntl, fork, owners nor modes; what is open, or mapped, keeps its name; what is there
is in the way of a rename; folders cannot be opened, nor what is only read be flushed; lines end as there;
some names cannot be; and a is A, on macOS too. Paths have slashes all the same, and libraries are those of
Linux, loaded before; with --core those alone that packages are made and checked with.
"""

import atexit
import builtins
import contextlib
import ctypes
import errno
import importlib
import io
import mmap
import os
import platform
import re
import runpy
import shutil
import signal
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import ModuleType, SimpleNamespace
from typing import Any

CORE = (
    "torch.func",
    "asyncio",
    "numpy.testing",
    "sympy",
    "jinja2",
    "typer.rich_utils",
    "rich.progress",
    "rich.console",
    "concurrent.futures.thread",
)
EXTRAS = (
    "multiprocessing.connection",
    "multiprocessing.popen_spawn_posix",
    "scipy.signal",
    "scipy.integrate",
    "pyarrow.parquet",
    "plotly.graph_objects",
    "matplotlib.figure",
    "matplotlib.backends.backend_agg",
    "mujoco",
)
"""Loaded, as the core is, while the system is still itself."""
MODULES = ("fcntl", "pwd", "grp", "resource", "termios", "pty", "tty", "syslog")
OF_OS = (
    *("fork", "forkpty", "register_at_fork", "killpg", "setsid", "set_blocking", "mkfifo", "uname", "fchmod"),
    *(f"get{kind}" for kind in ("uid", "euid", "gid", "egid", "pgid", "groups")),
    *(f"O_{flag}" for flag in ("NOFOLLOW", "NONBLOCK", "CLOEXEC", "DIRECTORY", "TMPFILE")),
)
OF_SIGNAL = ("SIGHUP", "SIGKILL", "SIGPIPE", "SIGALRM", "pthread_sigmask", "pthread_kill", "setitimer")
PROGRAMS = SimpleNamespace(NeedCurrentDirectoryForExePath=lambda command: False)
"""Answers to shutil.which, which asks Windows from Python 3.12 on."""
UNFIT = re.compile(r'[<>:"|?*\\\x00-\x1f]|[. ]$|^(con|prn|aux|nul|com[1-9]|lpt[1-9])(\.|$)', re.IGNORECASE)
LONGEST = 259


def is_open(path: Any) -> bool:
    """Return whether this process has a file, or one below a folder, open or mapped, or works there."""
    real = os.path.realpath(os.fspath(path))
    links = [f"/proc/self/fd/{number}" for number in os.listdir("/proc/self/fd")]
    held = []
    for link in (*links, "/proc/self/cwd"):
        with contextlib.suppress(OSError):
            held.append(os.readlink(link))
    with SYSTEM["open a file"]("/proc/self/maps", encoding="utf-8") as maps:
        held += [line.split(maxsplit=5)[5].rstrip("\n") for line in maps if line.count("/") > 1]
    return any(file == real or file.startswith(f"{real}/") for file in held)


SYSTEM: dict[str, Callable[..., Any]] = {"open a file": builtins.open}
"""Functions that the wrappers below call in the end."""


def in_the_case_that_is_there(path: Any) -> Any:
    """The name under which a path is there, if any, for which A is a."""
    if isinstance(path, int) or not isinstance(path, str | os.PathLike) or not os.fspath(path):
        return path
    text = os.fspath(path)
    if not isinstance(text, str) or text.startswith(("/proc", "/dev", "/sys")):
        return path
    found = "/" if text.startswith("/") else ""
    for part in filter(None, text.split("/")):
        here = f"{found}{part}"
        if not SYSTEM["lexists"](here):
            with contextlib.suppress(OSError):
                alike = [name for name in SYSTEM["listdir"](found or ".") if name.lower() == part.lower()]
                here = f"{found}{alike[0] if alike else part}"
        found = f"{here}/"
    return found if text.endswith("/") else found[:-1]


def case_blind() -> None:
    """Have every call that takes paths find them whatever their case."""
    os.path.lexists("/")

    def lexists(path: str) -> bool:
        try:
            SYSTEM["lstat"](path)
        except (OSError, ValueError):
            return False
        return True

    names = ("stat", "lstat", "open", "mkdir", "unlink", "remove", "rmdir", "listdir", "scandir", "utime")
    for name in (*names, "chmod", "readlink", "rename", "replace", "access"):
        SYSTEM[name] = getattr(os, name)
        paths = 2 if name in ("rename", "replace") else 1
        wrapped = _blind(SYSTEM[name], paths)
        for supported in (os.supports_follow_symlinks, os.supports_fd, os.supports_dir_fd):
            if SYSTEM[name] in supported:
                supported.add(wrapped)
        setattr(os, name, wrapped)
    SYSTEM["lexists"] = lexists
    shutil._use_fd_functions = False  # type: ignore[attr-defined]
    if hasattr(shutil, "_rmtree_impl"):  # which Python 3.14 decides on at import
        shutil._rmtree_impl = shutil._rmtree_unsafe  # type: ignore[attr-defined]
    io.open = builtins.open = _blind(builtins.open, 1)


def _blind(call: Callable[..., Any], paths: int) -> Callable[..., Any]:
    def blind(*given: Any, **named: Any) -> Any:
        return call(*map(in_the_case_that_is_there, given[:paths]), *given[paths:], **named)

    return blind


def refused(path: Any) -> PermissionError:
    return PermissionError(errno.EACCES, "Access is denied", str(path))


def require_fit(path: Any) -> None:
    """Raise OSError for a name that Windows does not have."""
    if isinstance(path, int):
        return
    for part in Path(os.fspath(path)).parts:
        if part != "/" and part not in (".", "..") and UNFIT.search(part):
            raise OSError(
                errno.EINVAL, "The filename, directory name, or volume label syntax is incorrect", path
            )
    if len(os.path.abspath(os.fspath(path))) > LONGEST:
        raise FileNotFoundError(errno.ENOENT, "The system cannot find the path specified", path)


def files_that_are_open_stay() -> None:
    rename, replace, unlink, rmdir, mkdir = os.rename, os.replace, os.unlink, os.rmdir, os.mkdir

    def renamed(source: Any, target: Any) -> None:
        require_fit(target)
        if is_open(source):
            raise refused(source)
        if os.path.lexists(target) and Path(target).resolve() != Path(source).resolve():
            raise FileExistsError(
                errno.EEXIST, "Cannot create a file when that file already exists", str(target)
            )
        rename(source, target)

    def replaced(source: Any, target: Any) -> None:
        require_fit(target)
        if is_open(source) or is_open(target) or os.path.isdir(target):
            raise refused(target)
        replace(source, target)

    def removed(path: Any) -> None:
        if is_open(path):
            raise refused(path)
        unlink(path)

    def folder_removed(path: Any) -> None:
        if is_open(path):
            raise refused(path)
        rmdir(path)

    def made(path: Any, mode: int = 0o777) -> None:
        require_fit(path)
        mkdir(path, mode)

    os.rename, os.replace, os.unlink, os.remove, os.rmdir = (
        renamed,
        replaced,
        removed,
        removed,
        folder_removed,
    )
    os.mkdir = made


def opening() -> None:
    """Folders cannot be opened, what is only read not be flushed, and text gets the line ends of Windows."""
    fcntl: Any = importlib.import_module("fcntl")
    low, high, fsync = os.open, io.open, os.fsync

    def opened(path: Any, flags: int, mode: int = 0o777, **named: Any) -> int:
        require_fit(path)
        if os.path.isdir(path):
            raise refused(path)
        return low(path, flags, mode, **named)

    def opened_file(file: Any, mode: str = "r", *given: Any, **named: Any) -> Any:
        require_fit(file)
        writes = set(mode) & set("wax") and "b" not in mode
        if writes and len(given) < 4 and named.get("newline") is None:
            named["newline"] = "\r\n"
        return high(file, mode, *given, **named)

    def flushed(descriptor: int) -> None:
        if fcntl.fcntl(descriptor, fcntl.F_GETFL) & os.O_ACCMODE == os.O_RDONLY:
            raise OSError(errno.EBADF, "Bad file descriptor")
        fsync(descriptor)

    os.open, os.fsync = opened, flushed
    io.open = builtins.open = opened_file


def owners_are_not_told() -> None:
    """No owner, and no mode but whether a file is only to be read."""
    for name in ("stat", "lstat", "fstat"):
        setattr(os, name, _without_owner(getattr(os, name)))
        os.supports_follow_symlinks.add(getattr(os, name))


FIRST = ("st_mode", "st_ino", "st_dev", "st_nlink", "st_uid", "st_gid", "st_size")
"""Fields that a stat_result has by their places, which from Python 3.13 on may not be named too."""


def _without_owner(call: Callable[..., Any]) -> Callable[..., os.stat_result]:
    def plain(*given: Any, **named: Any) -> os.stat_result:
        found = call(*given, **named)
        rest = {key: getattr(found, key) for key in dir(found) if key.startswith("st_") and key not in FIRST}
        kind = found.st_mode & ~0o777
        return os.stat_result((kind | 0o777, *tuple(found)[1:4], 0, 0, *tuple(found)[6:]), rest)

    return plain


class TemporaryFile:
    """A file that keeps its name until it is closed, and for as long as it is mapped."""

    def __init__(self, *given: Any, **named: Any) -> None:
        self._file = tempfile.NamedTemporaryFile(*given, **named, delete=False)  # noqa: SIM115

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)

    def __enter__(self) -> Any:
        return self

    def __exit__(self, *error: object) -> None:
        self._file.close()
        if is_open(self._file.name):
            atexit.register(SYSTEM["unlink"], self._file.name)
        else:
            os.unlink(self._file.name)


def locks() -> ModuleType:
    """Windows' locks of bytes, which are those of a file that is open, made of Linux' locks."""
    fcntl: Any = importlib.import_module("fcntl")
    module = ModuleType("msvcrt")
    module.LK_UNLCK, module.LK_LOCK, module.LK_NBLCK = range(3)  # type: ignore[attr-defined]

    def locking(descriptor: int, mode: int, count: int) -> None:
        assert (mode, count) == (2, 1)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise PermissionError(errno.EACCES, "Permission denied") from None

    module.locking = locking  # type: ignore[attr-defined]
    return module


def without(*kept: str) -> type:
    """A library as ctypes loads it, but that no calls which exchange folders are in the C library."""
    plain = ctypes.CDLL

    class Library(plain):  # type: ignore[misc, valid-type]
        def __init__(self, name: Any, *given: Any, **named: Any) -> None:
            if name is None and "C library" not in kept:
                raise TypeError("bad argument type for built-in operation")
            super().__init__(name, *given, **named)

        def __getattr__(self, name: str) -> Any:
            if name == "renameat2":
                raise AttributeError(name)
            return super().__getattr__(name)

    return Library


def windows() -> None:
    """Take away what Windows lacks."""
    case_blind()
    files_that_are_open_stay()
    opening()
    owners_are_not_told()
    tempfile.TemporaryFile = TemporaryFile
    sys.modules["msvcrt"] = locks()
    for name in MODULES:
        sys.modules[name] = None  # type: ignore[assignment]
    for module, names in ((os, OF_OS), (signal, OF_SIGNAL)):
        for name in names:
            if hasattr(module, name):
                delattr(module, name)
    signal.SIGBREAK = signal.SIGTTIN  # type: ignore[misc, assignment]
    for name in [name for name in dir(mmap) if name.startswith(("MAP_", "MADV_"))]:
        delattr(mmap, name)
    ctypes.CDLL = without()
    os.symlink = lambda *_, **__: (_ for _ in ()).throw(OSError(1314, "A required privilege is not held"))  # type: ignore[assignment]
    shutil._winapi = PROGRAMS  # type: ignore[attr-defined]
    sys.platform = "win32"


def macos() -> None:
    """Take away what macOS lacks."""
    case_blind()
    ctypes.CDLL = without("C library")
    sys.platform = "darwin"


def main() -> None:
    system, *arguments = sys.argv[1:]
    alone = arguments[0] == "--core"
    program, *arguments = arguments[alone:]
    for library in CORE if alone else (*CORE, *EXTRAS):
        with contextlib.suppress(ImportError):
            importlib.import_module(library)
    platform.uname()
    {"windows": windows, "macos": macos}[system]()
    sys.argv = [program, *arguments]
    sys.path[0] = str(Path(program).parent)
    runpy.run_path(program, run_name="__main__")


if __name__ == "__main__":
    main()
