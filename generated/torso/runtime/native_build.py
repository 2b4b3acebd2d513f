"""Compiling a robot's C once, into a cache.

A library's name is a hash of the sources, the flags, the compiler and the processor, so that a changed
package, or another machine with the same home directory, gets a library of its own. LINKWISE_CACHE names
another cache directory, CC another compiler.
"""

import hashlib
import platform
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from .native_cache import ELSEWHERE, cache_directory, is_whole, keep, locked
from .native_compiler import Compiler, find_compiler, processor
from .native_process import Tell, run_all, told

PARTS = {"decomposition": ("BLOCKS", "ONE_SAMPLE", "SINES"), "gradient": ("POSITION_GRADIENT", "SINES")}
"""Parts of a robot's file (see numbers.h) in its two libraries; what nobody asks for is not compiled."""


@dataclass(frozen=True)
class Sources:
    """A robot's C: the directory that holds NAME.c, NAMEf.c and their headers."""

    name: str
    directory: Path

    def file(self, real: str) -> Path:
        """File to compile for `real`, double or float."""
        return self.directory / f"{self.name}{'f' if real == 'float' else ''}.c"


def library(sources: Sources, real: str, what: str = "decomposition") -> Path:
    """Path of a library, compiled if it isn't there or isn't whole; raises RuntimeError if it cannot be.

    real: double or float; what: decomposition, which holds the torques alone too, or gradient.
    A terminal is told of the wait on stderr.
    """
    compiler = find_compiler()
    name = f"{sources.name}-{what}-{real}-{_fingerprint(sources, compiler)}"
    target = cache_directory() / f"{name}.so"
    if not is_whole(target):
        lock = target.with_suffix(".lock")
        with told(f"compiling {sources.name} ({what}, {real}), once") as tell, locked(lock, tell):
            if not is_whole(target):
                _build(compiler, sources.file(real), PARTS[what], target, tell)
    return target


def _fingerprint(sources: Sources, compiler: Compiler) -> str:
    """Hash of everything that the library depends on."""
    digest = hashlib.sha256()
    for path in sorted(sources.directory.iterdir()):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    place = (compiler.command, compiler.flags, compiler.version(), platform.machine(), processor())
    digest.update(repr(place).encode())
    return digest.hexdigest()[:20]


def _build(compiler: Compiler, source: Path, parts: Sequence[str], target: Path, tell: Tell) -> None:
    """Compile the parts side by side, link them, and move the library into place in one step."""
    folder = target.with_suffix(".build")
    try:
        shutil.rmtree(folder, ignore_errors=True)  # of a process that was killed: this one holds the lock
        folder.mkdir(mode=0o700)
        objects = [f"{folder}/{part}.o" for part in parts]
        commands = [compiler.compiling(source, part, made) for part, made in zip(parts, objects, strict=True)]
        made = folder / "library.so"
        try:
            run_all(commands, tell)
            run_all([compiler.linking(objects, str(made))], lambda _: tell("linking"))
        except RuntimeError as error:
            raise RuntimeError(f"{error}; the other back ends need no compiler") from None
        if not made.is_file():
            raise RuntimeError(f"{compiler.command[0]} made no library; point CC to a C compiler")
        keep(made, target)
    except OSError as error:
        place = error.filename or target
        raise RuntimeError(f"cannot write {place}: {error.strerror}; {ELSEWHERE}") from None
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    if not is_whole(target):
        raise RuntimeError(f"{target} did not stay as it was written; {ELSEWHERE}")
