"""A package's back ends and its C, as far as they can be loaded and compiled here."""

import os
from collections.abc import Callable
from contextlib import redirect_stderr, suppress
from dataclasses import dataclass
from functools import cached_property
from importlib.util import find_spec
from itertools import product
from typing import NamedTuple

from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.native.build import PARTS, Sources, library
from linkwise_runtime.native.system import system_here

from linkwise.check.c_functions import compile_c
from linkwise.check.compare import IndexRows, Result, is_short_of_memory, line_of, skipped
from linkwise.check.compiled_c import CompiledPackage
from linkwise.oracle.states import affordable
from linkwise.own_process import begun
from linkwise.package.load import Package
from linkwise.package.manifest import Manifest

OPTIONAL = ("torch",)
"""Libraries that a package's back ends may need beside NumPy."""


class BackendVariant(NamedTuple):
    """A back end, and the kernel that it computes by."""

    backend: str
    kernel: str = "auto"

    @property
    def label(self) -> str:
        """Name that results are reported under: of two kernels, closed forms have the back end's alone."""
        return f"{self.backend} by rule" if self.kernel == "rule" else self.backend


@dataclass(frozen=True)
class LoadedPackage:
    """An imported package, and what of it could be loaded and compiled here.

    samples: number of random states that are asked for
    """

    package: Package
    samples: int

    @property
    def manifest(self) -> Manifest:
        """Manifest of the package."""
        return self.package.manifest

    @property
    def backends(self) -> dict[BackendVariant, Dynamics]:
        """Models of all back ends that could be loaded."""
        return self._loading[0]

    @property
    def missing(self) -> list[Result]:
        """Results on the back ends that could not be loaded."""
        return self._loading[1]

    @cached_property
    def rows(self) -> IndexRows:
        """Indices of packed values, by the manifest's paths."""
        paths = [link.path for link in self.manifest.links]
        return IndexRows.of_paths(paths, self.package.module.ROBOT.linear)

    @property
    def has_c(self) -> bool:
        """True if the package has C."""
        return f"c/{self.manifest.name}.h" in self.manifest.files

    @cached_property
    def compiling(self) -> tuple[CompiledPackage | None, Result]:
        """The compiled C, None where it cannot be compiled, and the result on its headers."""
        return compile_c(self.manifest, self.package.directory, self.rows)

    @property
    def compiled(self) -> CompiledPackage | None:
        """The compiled C; None where there is none."""
        return self.compiling[0] if self.has_c else None

    @cached_property
    def count(self) -> tuple[int, int]:
        """Number of random states that memory allows, and of those at rest."""
        return affordable(self.samples, len(self.manifest.joints), len(self.manifest.links))

    @cached_property
    def _loading(self) -> tuple[dict[BackendVariant, Dynamics], list[Result]]:
        package = self.package
        if not package.backends:
            return {}, [skipped("back ends", "nothing to load: C and formulas only")]
        loaded: dict[BackendVariant, Dynamics] = {}
        missing: list[Result] = []
        for name in package.backends:
            try:
                model = package.load(name)
                chooses = getattr(model.backend, "kernel", "") == "auto" and model.backend.name != "native"
                for kernel in ("straight", "rule") if chooses else ("auto",):
                    loaded[BackendVariant(name, kernel)] = package.load(name, kernel=kernel)
            except Exception as error:
                if _lacks(error):
                    missing.append(skipped(f"{name}: not checked", " ".join(str(error).split())))
                else:
                    missing.append(Result(f"{name}: loads", False, None, line_of(error)))
        if not loaded:
            missing.append(Result("back ends", False, None, "none could be loaded; nothing was checked"))
        return loaded, missing


def compiled_beside(package: Package) -> Callable[[], None]:
    """Begin to compile the libraries of `native` beside other work, and return a call that waits for them.

    A failure is reported when they are needed.
    """
    if "native" not in package.backends or not system_here().forks:
        return lambda: None

    def compile_all() -> None:
        sources = Sources(package.manifest.name, package.directory / "c")
        with suppress(RuntimeError), open(os.devnull, "w") as nobody, redirect_stderr(nobody):
            for real, what in product(("double", "float"), PARTS):
                library(sources, real, what)

    return begun(compile_all)


def _lacks(error: Exception) -> bool:
    """Return whether a library, compiler, place to compile or stack is missing: not the package's fault."""
    if is_short_of_memory(error):
        return True
    if isinstance(error, ImportError):
        library = (error.name or "").partition(".")[0]
        return library in OPTIONAL and find_spec(library) is None
    here = any(word in str(error) for word in ("install", "LINKWISE_CACHE", "stack"))
    return isinstance(error, RuntimeError) and here and " failed: " not in str(error)
