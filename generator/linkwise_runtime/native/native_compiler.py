"""The C compiler of this system: what it is called, its flags, how it links, and what it lacks."""

import os
import platform
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from .native_process import answer
from .native_system import MacOS, OperatingSystem, Windows, system_here

FLAGS = ("-std=c99", "-O2", "-ftree-vectorize", "-fno-tree-slp-vectorize", "-ffp-contract=fast")
"""Flags of gcc and clang. Multiplications and additions may fuse, which -std=c99 alone forbids gcc."""

EXTENSION = ("-std=c11", "-O2")
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


MICROSOFT = ("cl", "clang-cl")
"""Compilers whose options are others."""


@dataclass(frozen=True)
class Compiler:
    """gcc or clang on Linux; the classes below are what is called like them on other systems."""

    command: tuple[str, ...]
    """How it is called, with any arguments that CC gives."""

    anywhere: ClassVar[tuple[str, ...]] = ("-fPIC",)
    """Flags for what is to be part of a shared library."""
    shared: ClassVar[tuple[str, ...]] = ("-shared",)
    """Flags that link one."""
    open_symbols: ClassVar[tuple[str, ...]] = ()
    """Flags that link one whose symbols are Python's."""
    makes_modules: ClassVar[bool] = True
    """Whether it can link a module for Python, knowing no more than Python's headers."""

    @classmethod
    def fault(cls, command: Sequence[str]) -> str:
        """Why a program that is there cannot be the compiler, in words; nothing if it can."""
        called = Path(command[0]).stem.lower()
        return f"{called}, whose options are not those of gcc" if called in MICROSOFT else ""

    @property
    def tuning(self) -> tuple[str, ...]:
        """Flags that make full use of this machine's processor."""
        return TUNING.get(platform.machine(), ())

    @property
    def flags(self) -> tuple[str, ...]:
        """What everything is compiled with, for a shared library on this machine."""
        return (*FLAGS, *self.tuning, *self.anywhere)

    def version(self) -> str:
        """What it says of itself; raises RuntimeError for what is not a program, or does not answer."""
        return answer([*self.command, "--version"], ANSWERS).decode(errors="replace")

    def compiling(self, source: Path, part: str, target: str) -> list[str]:
        """Command line that compiles one part of a robot's file."""
        return [*self.command, *self.flags, f"-DLINKWISE_PART={part}", "-c", str(source), "-o", target]

    def extending(self, source: Path, headers: Sequence[str], target: str) -> list[str]:
        """Command line that makes a module for Python, for any machine of this kind."""
        flags = (*EXTENSION, *self.anywhere, *self.shared, *self.open_symbols)
        included = [f"-I{folder}" for folder in headers]
        return [*self.command, *flags, *included, str(source), "-o", target]

    def linking(self, objects: Sequence[str], target: str) -> list[str]:
        """Command line that makes a shared library."""
        return [*self.command, *self.shared, *objects, "-lm", "-o", target]


class AppleCompiler(Compiler):
    """clang as Apple has it, also where it is called gcc. On ARM its own choice of processor is Apple's."""

    open_symbols = ("-undefined", "dynamic_lookup")

    @classmethod
    def fault(cls, command: Sequence[str]) -> str:
        """Apple's system has programs of these names that do no more than offer to install the compiler."""
        return super().fault(command) or ("" if cls(tuple(command)).version().strip() else "none installed")

    @property
    def tuning(self) -> tuple[str, ...]:
        """Flags that make full use of this machine's processor."""
        return () if platform.machine() == "arm64" else super().tuning


class MinGW(Compiler):
    """gcc or clang of MinGW-w64, on Windows.

    Nothing is tuned: with vectors of AVX, gcc counts on a stack that Windows does not align so (its bug
    54412), and what it makes crashes at random. A module would need an import library of Python's.
    """

    anywhere = ()
    shared = ("-shared", "-static-libgcc")
    makes_modules = False

    @classmethod
    def fault(cls, command: Sequence[str]) -> str:
        """clang for Microsoft's linker makes libraries that show no function unless each is marked."""
        if fault := super().fault(command):
            return fault
        microsoft = "windows-msvc" in cls(tuple(command)).version()
        return f"{Path(command[0]).stem} for Microsoft's linker" if microsoft else ""

    @property
    def tuning(self) -> tuple[str, ...]:
        """Nothing, see above."""
        return ()


KINDS: dict[type[OperatingSystem], type[Compiler]] = {
    OperatingSystem: Compiler,
    MacOS: AppleCompiler,
    Windows: MinGW,
}
"""What compiles on each system."""


def find_compiler() -> Compiler:
    """CC if set, else the first of the system's names for one; raises RuntimeError where there is none."""
    system = system_here()
    kind, unfit = KINDS[type(system)], []
    try:
        given = system.words(os.environ.get("CC", ""))
    except ValueError as error:
        raise RuntimeError(f"CC={os.environ['CC']!r} is not a command: {error}") from None
    for candidate in [given] if given else [[name] for name in system.compilers]:
        if shutil.which(candidate[0]):
            if not (fault := kind.fault(candidate)):
                return kind(tuple(candidate))
            unfit.append(fault)
    found = unfit[0] if unfit else f"no program {given[0]}" if given else "none"
    raise RuntimeError(
        f"the native back end needs a C compiler and found {found}: {system.install}; "
        "the other back ends need none"
    )


def processor() -> str:
    """What -march=native depends on."""
    return system_here().processor()
