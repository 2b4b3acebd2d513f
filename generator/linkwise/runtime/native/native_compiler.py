"""The C compiler of this system: what it is called, its flags, and how it links."""

import os
import platform
import shlex
import shutil
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from .native_process import answer

FLAGS = ("-std=c99", "-O2", "-ftree-vectorize", "-fno-tree-slp-vectorize", "-ffp-contract=fast")
"""Flags of gcc and clang. Multiplications and additions may fuse, which -std=c99 alone forbids gcc."""

EXTENSION = ("-std=c11", "-O2", "-fPIC", "-shared")
"""Flags for a module of Python, whose headers C99 does not do for."""

TUNING = {
    "x86_64": ("-march=native", "-mprefer-vector-width=512"),
    "AMD64": ("-march=native", "-mprefer-vector-width=512"),
    "aarch64": ("-mcpu=native",),
    "arm64": ("-mcpu=native",),
}
"""What makes full use of this machine's processor, by its kind."""

ANSWERS = 30.0
"""Seconds in which a compiler says its version."""


@dataclass(frozen=True)
class Compiler:
    """A compiler that is called like gcc and clang; another kind would be a class beside this one."""

    command: tuple[str, ...]
    """How it is called, with any arguments that CC gives."""

    @property
    def flags(self) -> tuple[str, ...]:
        """What everything is compiled with, for a shared library on this machine."""
        return (*FLAGS, *TUNING.get(platform.machine(), ()), "-fPIC")

    def version(self) -> str:
        """What it says of itself; raises RuntimeError for what is not a program, or does not answer."""
        return answer([*self.command, "--version"], ANSWERS).decode(errors="replace")

    def compiling(self, source: Path, part: str, target: str) -> list[str]:
        """Command line that compiles one part of a robot's file."""
        return [*self.command, *self.flags, f"-DLINKWISE_PART={part}", "-c", str(source), "-o", target]

    def extending(self, source: Path, headers: Sequence[str], target: str) -> list[str]:
        """Command line that makes a module for Python, for any machine of this kind."""
        open_symbols = ("-undefined", "dynamic_lookup") if sys.platform == "darwin" else ()
        included = [f"-I{folder}" for folder in headers]
        return [*self.command, *EXTENSION, *open_symbols, *included, str(source), "-o", target]

    def linking(self, objects: Sequence[str], target: str) -> list[str]:
        """Command line that makes a shared library."""
        return [*self.command, "-shared", *objects, "-lm", "-o", target]


def find_compiler() -> Compiler:
    """CC if set, else cc, gcc or clang; raises RuntimeError where there is none."""
    try:
        given = shlex.split(os.environ.get("CC", ""))
    except ValueError as error:
        raise RuntimeError(f"CC={os.environ['CC']!r} is not a command: {error}") from None
    for candidate in [given] if given else [["cc"], ["gcc"], ["clang"]]:
        if shutil.which(candidate[0]):
            return Compiler(tuple(candidate))
    found = f"no program {given[0]}" if given else "none"
    raise RuntimeError(
        f"the native back end needs a C compiler and found {found}: install the package gcc (Debian, "
        "Ubuntu: apt install gcc; Fedora: dnf install gcc; macOS: xcode-select --install) or point CC to "
        "one; the other back ends need none"
    )


def processor() -> str:
    """What -march=native depends on."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        return platform.processor()
    return repr(sorted({line for line in lines if line.startswith(("model name", "flags", "Features"))}))
