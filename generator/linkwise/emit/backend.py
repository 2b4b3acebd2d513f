"""The registry of back ends: adding one adds an entry here, and its name to LOOPS if loops serve it.

`check` and the command line read entries too, and need not wait for SymPy: emitters are imported when they
emit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from linkwise.errors import LinkwiseError

if TYPE_CHECKING:
    from linkwise.emit.derivation import Derivation
    from linkwise.package.entries import KernelKind
    from linkwise.symbolic.system import System

Emitter = Callable[["Derivation"], Iterator[tuple[str, str]]]
"""Function that turns a derivation into files: paths inside the package and texts."""


def _no_fault(_: System) -> str:
    return ""


def _always(_: System) -> bool:
    return True


def _too_large_for_straight(system: System) -> str:
    from linkwise.emit.c.stack import too_large_for_straight

    return too_large_for_straight(system)


def _are_short(system: System) -> bool:
    from linkwise.emit.formulas import are_short

    return are_short(system)


def _too_large_for_loops(system: System) -> str:
    from linkwise.emit.c.stack import too_large_for_loops

    return too_large_for_loops(system)


@dataclass(frozen=True)
class Loading:
    """Way in which a package's `load` makes a back end: the class in linkwise_runtime, and its arguments."""

    module: str
    """Module of linkwise_runtime that holds the class."""
    made: str
    """Expression over the imported names, ROBOT, and `values` of the parameters."""
    imports: tuple[str, ...]
    """Import statements before it."""
    speed: int
    """Rank among the back ends that compute, 1 the fastest for a large batch."""
    uses_forms: bool = False
    """True if it may be made of LINKS, the closed forms, which are None where the kernel is in loops."""
    uses_rule: bool = False
    """True if it may be made of RULE, the vectorised rule of rigid links, which is None for energies."""
    face: str = "Dynamics"
    """Class of the object that `load` returns; any other than `Dynamics` is in the module."""
    chooses: bool = False
    """True if it has kernels to choose from and accepts bodies, as `kernel` and `bodies`."""
    learns: bool = False
    """True if its links are torch modules, whose numbers `requires_grad` makes nn.Parameters."""


@dataclass(frozen=True)
class BackendFiles:
    """Contribution of a back end to a package."""

    name: str
    doc: str
    emits: tuple[Emitter, ...]
    """Emitters of its files for the robot; two back ends with one emitter share its files."""
    loading: Loading | None = None
    """Way to load it; None where nothing loads."""
    needs: tuple[str, ...] = ()
    """Other back ends that it requires."""
    fault: Callable[[System], str] = _no_fault
    """Function that returns why it cannot be had for a robot; empty if it can."""
    usual: Callable[[System], bool] = _always
    """Function that returns whether a robot has it where no back end was asked for."""


def _forms(d: Derivation) -> Iterator[tuple[str, str]]:
    from linkwise.emit.closed_forms import closed_form_files

    return closed_form_files(d.system, d.forms)


def _tree(d: Derivation) -> Iterator[tuple[str, str]]:
    from linkwise.emit.tree_file import tree_text
    from linkwise.symbolic.definition import formula_texts, joint_tree

    if (tree := joint_tree(d.system)) is not None:
        names = [symbol.name for symbol in d.system.parameters]
        yield "tree.py", tree_text(tree, formula_texts(d.system), names)


def _energies(d: Derivation) -> Iterator[tuple[str, str]]:
    from linkwise.emit.autograd import autograd_files

    return autograd_files(d.system, d.nonquadratic)


def _c(d: Derivation) -> Iterator[tuple[str, str]]:
    from linkwise.emit.c.shared_headers import with_headers
    from linkwise.emit.c.sources import c_files

    return with_headers(c_files(d))


def _loops(d: Derivation) -> Iterator[tuple[str, str]]:
    from linkwise.emit.c.loops import loop_files
    from linkwise.emit.c.shared_headers import with_headers

    return with_headers(loop_files(d))


def _formulas(d: Derivation) -> Iterator[tuple[str, str]]:
    from linkwise.emit.formulas import formula_files

    return formula_files(d)


BACKENDS: dict[str, BackendFiles] = {
    backend.name: backend
    for backend in (
        BackendFiles(
            "numpy",
            "closed forms, or the vectorised rule, on NumPy arrays",
            emits=(_forms, _tree),
            loading=Loading(
                "arrays.numpy_backend",
                "NumpyBackend(ROBOT, LINKS, values, RULE, kernel, bodies)",
                (),
                speed=2,
                uses_forms=True,
                uses_rule=True,
                chooses=True,
            ),
        ),
        BackendFiles(
            "torch",
            "closed forms, or the vectorised rule, on torch tensors",
            emits=(_forms, _tree),
            loading=Loading(
                "arrays.torch_backend",
                "TorchBackend(ROBOT, LINKS, values, RULE, kernel, bodies)",
                (),
                speed=3,
                uses_forms=True,
                uses_rule=True,
                chooses=True,
            ),
        ),
        BackendFiles(
            "autograd",
            "each link's Lagrangian, differentiated by torch",
            emits=(_energies, _tree),
            loading=Loading(
                "lagrangians.dynamics_module",
                "backend_of_links(ROBOT, LAGRANGIANS, values, requires_grad, RULE)",
                ("from .energies import LAGRANGIANS",),
                speed=4,
                face="DynamicsModule",
                uses_rule=True,
                learns=True,
            ),
        ),
        BackendFiles(
            "native",
            "the C code, compiled by this system's compiler",
            emits=(_tree,),
            loading=Loading(
                "native.backend",
                'NativeBackend(ROBOT, Path(__file__).parent / "c", LINKS, values, RULE)',
                ("from pathlib import Path",),
                speed=1,
                uses_forms=True,
                uses_rule=True,
            ),
            needs=("c", "numpy", "torch"),
        ),
        BackendFiles(
            "c",
            "closed forms in C99 and C++17, to compile into a program of your own",
            emits=(_c,),
            fault=_too_large_for_straight,
        ),
        BackendFiles(
            "formulas",
            "closed forms to read; of small robots, expanded",
            emits=(_formulas,),
            usual=_are_short,
        ),
    )
}


LOOPS: dict[str, BackendFiles] = {
    backend.name: backend
    for backend in (
        replace(BACKENDS["numpy"], doc="the vectorised rule on NumPy arrays", emits=(_tree,)),
        replace(BACKENDS["torch"], doc="the vectorised rule on torch tensors", emits=(_tree,)),
        BACKENDS["autograd"],
        BACKENDS["native"],
        replace(
            BACKENDS["c"],
            doc="loops over links and joints in C99 and C++17, to compile into a program of your own",
            emits=(_loops,),
            fault=_too_large_for_loops,
        ),
    )
}
"""Back ends of a package whose kernel is in loops, for which no closed forms are derived."""


def backends_of(kernel: KernelKind) -> dict[str, BackendFiles]:
    """Return the back ends that a package can have, by name."""
    return LOOPS if kernel == "loops" else BACKENDS


def usual_backends(system: System, kernel: KernelKind) -> tuple[str, ...]:
    """Return the names of the back ends that a robot's package has where none was asked for."""
    there = backends_of(kernel).values()
    return tuple(one.name for one in there if one.usual(system))


def refuse_unknown(names: Iterable[str]) -> None:
    """Raise LinkwiseError for a name that no back end has."""
    if unknown := [name for name in names if name not in BACKENDS]:
        raise LinkwiseError(f"no back end {unknown[0]!r}; choose among {', '.join(BACKENDS)}")


def chosen_backends(names: Iterable[str], kernel: KernelKind = "straight") -> tuple[BackendFiles, ...]:
    """Return back ends by name, and those that they need, in the registry's order.

    Raises LinkwiseError for no name, an unknown one, and one that takes closed forms where there are none.
    """
    wanted, there = list(names), backends_of(kernel)
    if not wanted:
        raise LinkwiseError(f"no back end is asked for; choose among {', '.join(there)}")
    refuse_unknown(wanted)
    for name in wanted:
        if name not in there:
            raise LinkwiseError(
                f"the back end {name!r} is not there with --kernel loops, which derives no formulas; choose "
                f"among {', '.join(there)}, or take --kernel straight"
            )
    wanted += [needed for name in wanted for needed in there[name].needs]
    return tuple(backend for name, backend in there.items() if name in wanted)
