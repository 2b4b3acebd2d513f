"""Compiles a robot's C once, into a cache.

A library's name is a hash of the sources, the flags, the compiler and the processor, so that a changed
package, or another machine with the same home directory, gets a library of its own. LINKWISE_CACHE names
another cache directory, CC another compiler.
"""

import hashlib
import platform
import re
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from ..structure import Structure
from .cache import ELSEWHERE, cache_directory, is_whole, keep, locked
from .compiler import Compiler, find_compiler, processor
from .process import Tell, run_all, shown_on_one_line
from .system import system_here

PARTS = {
    "decomposition": ("BLOCKS", "ONE_SAMPLE", "SINES"),
    "gradient": ("POSITION_GRADIENT", "SINES"),
    "regressors": ("REGRESSORS", "SINES"),
    "control": ("CONTROL", "SINES"),
    "constraints": ("CONSTRAINTS", "SINES"),
}
"""Parts of a robot's C file (see numbers.h) by library; a library is compiled when first asked for."""

MADE = "library"
"""File name of a library while it is being built, without its ending."""

STACK = re.compile(r"none\s+takes\s+more\s+than\s+([\d,]+)\s+bytes")
"""Pattern of the line in NAME.h that says how much stack its functions take."""

Commands = Callable[[Path], Sequence[Sequence[Sequence[str]]]]
"""Command lines that make a library in a folder: first those that run side by side, then those after them."""


@dataclass(frozen=True)
class Sources:
    """A robot's C: the directory that holds NAME.c, NAMEf.c and their headers."""

    name: str
    directory: Path
    digest: str = ""
    """Hash of the directory's files when the robot was loaded; empty where any files will do."""

    def file(self, real: str) -> Path:
        """Return the path of the file to compile for `real`, double or float."""
        return self.directory / f"{self.name}{'f' if real == 'float' else ''}.c"


@cache
def loaded(structure: Structure, directory: Path) -> Sources:
    """Return a robot's C as first loaded: files generated later do not fit the Python that is running."""
    return Sources(structure.name, directory, digest_of(directory))


def library(sources: Sources, real: str, what: str = "decomposition") -> Path:
    """Return the path of a library, compiled if it is missing or not whole.

    Raises RuntimeError where it cannot be compiled, and where the sources are not those that were loaded.

    real: double or float; what: decomposition, which holds the torques alone too, or another of PARTS.
    On a terminal, stderr shows that it is being compiled.
    """
    digest = sources.digest or digest_of(sources.directory)

    def check() -> None:
        if digest_of(sources.directory) != digest:
            raise RuntimeError(
                f"{sources.name} was generated anew after it was loaded; start Python again to use it"
            )

    check()
    require_stack(sources.name, sources.directory)
    compiler = find_compiler()

    def commands(folder: Path) -> list[list[list[str]]]:
        parts = PARTS[what]
        objects = [f"{folder}/{part}.o" for part in parts]
        source = sources.file(real)
        compiling = [
            compiler.compiling(source, part, made) for part, made in zip(parts, objects, strict=True)
        ]
        return [compiling, [compiler.linking(objects, str(_made(folder)))]]

    name = f"{sources.name}-{what}-{real}-{_fingerprint(digest, compiler)}"
    return _kept(name, f"{sources.name} ({what}, {real})", compiler, commands, check)


def require_stack(name: str, directory: Path) -> None:
    """Raise RuntimeError where a robot's C takes more stack, by its NAME.h, than is safe on this system."""
    header = directory / f"{name}.h"
    text = header.read_text(encoding="utf-8") if header.is_file() else ""
    told, most = STACK.search(text), system_here().stack
    if told is not None and int(told[1].replace(",", "")) > most:
        raise RuntimeError(
            f"the C of {name} takes {told[1]} bytes of stack, and {most:,} are the most that are safe on "
            "this system; use the other back ends, which need none"
        )


def extension(source: Path, headers: Sequence[str], versions: Sequence[str]) -> Path:
    """Return the path of a Python extension module, made of one file and compiled into the cache.

    Raises RuntimeError where it cannot be compiled.

    versions: what it depends on besides its text and the compiler
    """
    compiler = find_compiler()
    if not compiler.makes_modules:
        raise RuntimeError(f"{compiler.command[0]} makes no modules for Python here")

    def commands(folder: Path) -> list[list[list[str]]]:
        return [[compiler.extending(source, headers, str(_made(folder)))]]

    place = (
        compiler.command,
        compiler.extending(source, headers, ""),
        compiler.version(),
        platform.machine(),
    )
    digest = hashlib.sha256(source.read_bytes() + repr((place, *versions)).encode())
    return _kept(f"{source.stem}-{digest.hexdigest()[:20]}", source.stem, compiler, commands, lambda: None)


def _kept(name: str, what: str, compiler: Compiler, commands: Commands, check: Callable[[], None]) -> Path:
    """Return a library's path in the cache, built there if need be; `check` raises for one not to be kept."""
    target = cache_directory() / f"{name}{system_here().library}"
    if not is_whole(target):
        lock = target.with_suffix(".lock")
        with shown_on_one_line(f"compiling {what}, once") as tell, locked(lock, tell):
            if not is_whole(target):
                _build(compiler, commands, target, tell, check)
    return target


def _made(folder: Path) -> Path:
    return folder / f"{MADE}{system_here().library}"


def digest_of(directory: Path) -> str:
    """Return a hash of the names and bytes of all files; raise RuntimeError where they cannot be read."""
    digest = hashlib.sha256()
    try:
        for path in _inside(directory):
            if not path.is_file():  # a pipe, say, whose end would be waited for
                raise RuntimeError(f"{path} is no file; generate it again")
            name = path.relative_to(directory).as_posix()
            digest.update(name.encode() + b"\0" + path.read_bytes() + b"\0")
    except OSError as error:
        raise RuntimeError(f"cannot read {error.filename}: {error.strerror}; generate it again") from None
    return digest.hexdigest()


def _inside(directory: Path) -> Iterator[Path]:
    """Yield the files in a folder and in its subfolders, in order."""
    for path in sorted(directory.iterdir()):
        if path.is_dir() and not path.is_symlink():
            yield from _inside(path)
        else:
            yield path


def _fingerprint(digest: str, compiler: Compiler) -> str:
    """Return a hash of everything that the library depends on."""
    place = (digest, compiler.command, compiler.flags, compiler.version(), platform.machine(), processor())
    return hashlib.sha256(repr(place).encode()).hexdigest()[:20]


def _build(
    compiler: Compiler, commands: Commands, target: Path, tell: Tell, check: Callable[[], None]
) -> None:
    """Compile the parts side by side, link them, and move the library into place in one step."""
    folder = target.with_suffix(".build")
    try:
        shutil.rmtree(folder, ignore_errors=True)  # left by a killed process: this one holds the lock
        folder.mkdir(mode=0o700)
        made = _made(folder)
        try:
            first, *last = commands(folder)
            run_all(first, tell)
            for linking in last:
                run_all(linking, lambda _: tell("linking"))
        except RuntimeError as error:
            raise RuntimeError(f"{error}; the other back ends need no compiler") from None
        if not made.is_file():
            raise RuntimeError(f"{compiler.command[0]} made no library; point CC to a C compiler")
        check()  # the sources may have changed while they were compiled
        keep(made, target)
    except OSError as error:
        place = error.filename or target
        raise RuntimeError(f"cannot write {place}: {error.strerror}; {ELSEWHERE}") from None
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    if not is_whole(target):
        raise RuntimeError(f"{target} did not stay as it was written; {ELSEWHERE}")
