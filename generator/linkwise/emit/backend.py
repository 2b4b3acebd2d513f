"""The registry of back ends: adding one adds an entry here and touches no other list of names.

An entry is read by the command line too, so that this file imports what emits only when it emits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

from linkwise.errors import LinkwiseError

if TYPE_CHECKING:
    from linkwise.emit.derivation import Derivation

Emitter = Callable[["Derivation"], Iterator[tuple[str, str]]]
"""Turns a derivation into files: paths inside the package and texts."""


@dataclass(frozen=True)
class Loading:
    """How the package's `load` makes the back end: the class in runtime/, and what it is made of."""

    module: str
    """Module in runtime/ that holds the class."""
    made: str
    """Expression over the imported names, ROBOT, and `values` of the parameters."""
    imports: tuple[str, ...]
    """Statements before it."""
    speed: int
    """Rank among the back ends that compute, 1 the fastest for a large batch."""


@dataclass(frozen=True)
class BackendFiles:
    """What a back end adds to a package."""

    name: str
    doc: str
    emits: tuple[Emitter, ...]
    """What is written for the robot; two back ends with one emitter share its files."""
    runtime: tuple[str, ...] = ()
    """Files copied from linkwise/runtime, beside those of every package."""
    loading: Loading | None = None
    """None where nothing loads."""
    needs: tuple[str, ...] = ()
    """Other back ends without which it cannot be."""
    shares_work: bool = False
    """Whether it has a kernel of all links where they share work."""


def _forms(d: Derivation) -> Iterator[tuple[str, str]]:
    from linkwise.emit.closed_forms import closed_form_files

    return closed_form_files(d.system, d.kernels)


def _energies(d: Derivation) -> Iterator[tuple[str, str]]:
    from linkwise.emit.autograd import autograd_files

    return autograd_files(d.system, d.linear)


def _c(d: Derivation) -> Iterator[tuple[str, str]]:
    from linkwise.emit.c.sources import c_files

    return c_files(d)


def _formulas(d: Derivation) -> Iterator[tuple[str, str]]:
    from linkwise.emit.formulas import formula_files

    return formula_files(d)


LINKS = "from .forms import LINKS"

BACKENDS: dict[str, BackendFiles] = {
    backend.name: backend
    for backend in (
        BackendFiles(
            "numpy",
            "closed forms on NumPy arrays",
            emits=(_forms,),
            runtime=("numpy_backend.py",),
            loading=Loading("numpy_backend", "NumpyBackend(ROBOT, LINKS, values)", (LINKS,), speed=2),
        ),
        BackendFiles(
            "torch",
            "closed forms on torch tensors",
            emits=(_forms,),
            runtime=("torch_backend.py",),
            loading=Loading("torch_backend", "TorchBackend(ROBOT, LINKS, values)", (LINKS,), speed=3),
        ),
        BackendFiles(
            "autograd",
            "each link's Lagrangian, differentiated by torch",
            emits=(_energies,),
            runtime=(
                "autograd_backend.py",
                "partial_lagrangian.py",
                "recording.py",
                "torch_backend.py",
            ),
            loading=Loading(
                "autograd_backend",
                "AutogradBackend(ROBOT, links, values)",
                ("from .energies import links",),
                speed=4,
            ),
        ),
        BackendFiles(
            "native",
            "the C code, compiled by this system's compiler",
            emits=(),
            runtime=(
                "native_answers.py",
                "native_backend.py",
                "native_build.py",
                "native_cache.py",
                "native_calls.py",
                "native_compiler.py",
                "native_library.py",
                "native_memory.py",
                "native_module.c",
                "native_module.py",
                "native_process.py",
                "native_torch.py",
                "numpy_backend.py",
                "torch_backend.py",
            ),
            loading=Loading(
                "native_backend",
                'NativeBackend(ROBOT, Path(__file__).parent / "c", LINKS, values)',
                ("from pathlib import Path", LINKS),
                speed=1,
            ),
            needs=("c", "torch"),
        ),
        BackendFiles(
            "c",
            "closed forms in C99 and C++17, to compile into a program of your own",
            emits=(_c,),
            shares_work=True,
        ),
        BackendFiles("formulas", "closed forms to read, for small robots", emits=(_formulas,)),
    )
}


def chosen_backends(names: Iterable[str]) -> tuple[BackendFiles, ...]:
    """Back ends by name and those that they need, in this order; raises LinkwiseError for an unknown name."""
    wanted = list(names)
    for name in wanted:
        if name not in BACKENDS:
            raise LinkwiseError(f"no back end {name!r}; choose among {', '.join(BACKENDS)}")
    wanted += [needed for name in wanted for needed in BACKENDS[name].needs]
    return tuple(backend for name, backend in BACKENDS.items() if name in wanted)
