"""Compiling a robot's C once, into a cache.

A library's name is a hash of the sources, the flags, the compiler and the processor, so that a changed
package, or another machine with the same home directory, gets a library of its own. LINKWISE_CACHE names
another cache directory, CC another compiler.
"""

import hashlib
import os
import platform
import subprocess
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from .native_compiler import Compiler, find_compiler, processor

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
    """Path of a library, compiled if it isn't there; raises RuntimeError if it cannot be.

    real: double or float; what: decomposition, which holds the torques alone too, or gradient.
    """
    compiler = find_compiler()
    name = f"{sources.name}-{what}-{real}-{_fingerprint(sources, compiler)}"
    target = cache_directory() / f"{name}.so"
    if not target.exists():
        with _locked(target.with_suffix(".lock")):
            if not target.exists():
                _build(compiler, sources.file(real), PARTS[what], target)
    return target


def cache_directory() -> Path:
    """LINKWISE_CACHE, or linkwise in the user's cache directory; made if need be."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    path = Path(os.environ.get("LINKWISE_CACHE") or Path(base) / "linkwise")
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise RuntimeError(f"cannot make the cache {path}: {error.strerror}; set LINKWISE_CACHE") from None
    return path


def _fingerprint(sources: Sources, compiler: Compiler) -> str:
    """Hash of everything that the library depends on."""
    digest = hashlib.sha256()
    for path in sorted(sources.directory.iterdir()):
        digest.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    place = (compiler.command, compiler.flags, compiler.version, platform.machine(), processor())
    digest.update(repr(place).encode())
    return digest.hexdigest()[:20]


@contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Keep other processes out while one builds; the lock goes with the process that holds it."""
    import fcntl

    try:
        file = path.open("w")
    except OSError as error:
        raise RuntimeError(
            f"cannot write to the cache {path.parent}: {error.strerror}; set LINKWISE_CACHE"
        ) from None
    with file:
        fcntl.flock(file, fcntl.LOCK_EX)
        yield


def _build(compiler: Compiler, source: Path, parts: Sequence[str], target: Path) -> None:
    """Compile the parts side by side, link them, and move the library into place in one step."""
    with tempfile.TemporaryDirectory(dir=target.parent) as folder:
        objects = [f"{folder}/{part}.o" for part in parts]
        commands = [compiler.compiling(source, part, made) for part, made in zip(parts, objects, strict=True)]
        running = [subprocess.Popen(c, stderr=subprocess.PIPE, text=True) for c in commands]
        for process in running:
            _check(compiler, process.communicate()[1], process.returncode)
        made = f"{folder}/library.so"
        done = subprocess.run(compiler.linking(objects, made), capture_output=True, text=True, check=False)
        _check(compiler, done.stderr, done.returncode)
        if not os.path.exists(made):
            raise RuntimeError(f"{compiler.command[0]} made no library; point CC to a C compiler")
        os.replace(made, target)


def _check(compiler: Compiler, errors: str, code: int) -> None:
    """Raise RuntimeError with the compiler's first complaint if it failed."""
    if code:
        first = next((line for line in errors.splitlines() if "error" in line), errors.strip()[:200])
        reason = first or f"exit status {code}"
        raise RuntimeError(f"{compiler.command[0]} failed: {reason}; the other back ends need no compiler")
