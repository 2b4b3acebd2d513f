"""The C compiler of this system: its name, its flags, how it links, and what it lacks."""

import os
import platform
import shutil
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from .process import answer
from .system import MacOS, OperatingSystem, Windows, system_here

FLAGS = ("-std=c99", "-O2", "-ftree-vectorize", "-fno-tree-slp-vectorize", "-ffp-contract=fast")
"""Flags of gcc and clang. Multiplications and additions may fuse, which -std=c99 alone forbids gcc."""

EXTENSION = ("-std=c11", "-O2")
"""Flags for a Python extension module, whose headers need more than C99."""

TUNING = {
    "x86_64": ("-march=native", "-mprefer-vector-width=512"),
    "AMD64": ("-march=native", "-mprefer-vector-width=512"),
    "aarch64": ("-mcpu=native",),
    "arm64": ("-mcpu=native",),
}
"""Flags that make full use of this machine's processor, by its kind."""

ANSWERS = 30.0
"""Seconds in which a compiler must report its version."""


MICROSOFT = ("cl", "clang-cl")
"""Compilers whose options are not those of gcc."""


@dataclass(frozen=True)
class Compiler:
    """gcc or clang on Linux; the subclasses are the compilers of other systems."""

    command: tuple[str, ...]
    """Command that calls it, with any arguments that CC gives."""

    anywhere: ClassVar[tuple[str, ...]] = ("-fPIC",)
    """Flags for code that is to be part of a shared library."""
    shared: ClassVar[tuple[str, ...]] = ("-shared",)
    """Flags that link a shared library."""
    open_symbols: ClassVar[tuple[str, ...]] = ()
    """Flags that link a library some of whose symbols are defined by Python."""
    makes_modules: ClassVar[bool] = True
    """True if it can link a Python extension module with nothing but Python's headers."""

    @classmethod
    def fault(cls, command: Sequence[str]) -> str:
        """Return why a program that exists cannot be the compiler, in words; "" if it can."""
        called = Path(command[0]).stem.lower()
        return f"{called}, whose options are not those of gcc" if called in MICROSOFT else ""

    @property
    def tuning(self) -> tuple[str, ...]:
        """Flags that make full use of this machine's processor."""
        return TUNING.get(platform.machine(), ())

    @property
    def flags(self) -> tuple[str, ...]:
        """Flags that compile code for a shared library on this machine."""
        return (*FLAGS, *self.tuning, *self.anywhere)

    def version(self) -> str:
        """Return the compiler's --version; raise RuntimeError for one that cannot run or does not answer."""
        return answer([*self.command, "--version"], ANSWERS).decode(errors="replace")

    def compiling(self, source: Path, part: str, target: str) -> list[str]:
        """Return the command line that compiles one part of a robot's file."""
        return [*self.command, *self.flags, f"-DLINKWISE_PART={part}", "-c", str(source), "-o", target]

    def extending(self, source: Path, headers: Sequence[str], target: str) -> list[str]:
        """Return the command line that makes a Python extension module, for any machine of this kind."""
        flags = (*EXTENSION, *self.anywhere, *self.shared, *self.open_symbols)
        included = [f"-I{folder}" for folder in headers]
        return [*self.command, *flags, *included, str(source), "-o", target]

    def linking(self, objects: Sequence[str], target: str) -> list[str]:
        """Return the command line that links a shared library."""
        return [*self.command, *self.shared, *objects, "-lm", "-o", target]


class AppleCompiler(Compiler):
    """clang as Apple ships it, also under the name gcc. On ARM, Apple's default processor is kept."""

    open_symbols = ("-undefined", "dynamic_lookup")

    @classmethod
    def fault(cls, command: Sequence[str]) -> str:
        """Return why it cannot be the compiler: Apple's programs may do no more than offer to install it."""
        return super().fault(command) or ("" if cls(tuple(command)).version().strip() else "none installed")

    @property
    def tuning(self) -> tuple[str, ...]:
        """Flags that make full use of this machine's processor."""
        return () if platform.machine() == "arm64" else super().tuning


class MinGW(Compiler):
    """gcc or clang of MinGW-w64, on Windows.

    No tuning: for AVX vectors, gcc relies on a stack alignment that Windows does not give (gcc bug 54412),
    and the code crashes at random. An extension module would need an import library of Python's.
    """

    anywhere = ()
    shared = ("-shared", "-static-libgcc")
    makes_modules = False

    @classmethod
    def fault(cls, command: Sequence[str]) -> str:
        """Return why it cannot be the compiler: clang for Microsoft's linker exports no unmarked function."""
        if fault := super().fault(command):
            return fault
        microsoft = "windows-msvc" in cls(tuple(command)).version()
        return f"{Path(command[0]).stem} for Microsoft's linker" if microsoft else ""

    @property
    def tuning(self) -> tuple[str, ...]:
        """No flags, for the reason given by the class."""
        return ()


KINDS: dict[type[OperatingSystem], type[Compiler]] = {
    OperatingSystem: Compiler,
    MacOS: AppleCompiler,
    Windows: MinGW,
}
"""Compiler of each system."""


def find_compiler() -> Compiler:
    """Return CC if set, else the first compiler found; raise RuntimeError where none is fit."""
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
    """Return a description of the processor, on which -march=native depends."""
    return system_here().processor()
