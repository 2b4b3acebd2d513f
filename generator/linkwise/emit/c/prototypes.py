"""Functions of a robot's header: their parameters, the shapes of these, and the cost of a sample."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from operator import itemgetter

from linkwise.emit.c.form_function import CFormFunction
from linkwise.emit.c.sizes import Span

NUMBERS = {"c2": "C2", "c1": "C1", "g": "G", "tau": "G", "h1": "H1", "c0": "C1"}
"""Names in C of the numbers of entries."""


@dataclass(frozen=True)
class Shapes:
    """Shapes of what functions read and write: in rows of samples, in blocks, for one sample.

    Coefficients are those of a motion without qdd, here called at rest.
    """

    motion: str
    motion_at_rest: str
    results: str
    motion_blocks: str
    results_blocks: str
    motion_one: str
    position_one: str
    motion_one_at_rest: str
    torque_one: str


@dataclass(frozen=True)
class LinkFunction:
    """The function of one link, counted from 1: its outputs, and their shapes."""

    number: int
    outputs: str
    shapes: str


@dataclass(frozen=True)
class Functions:
    """The functions of one number type."""

    title: str
    type: str
    suffix: str
    inputs: str
    inputs_at_rest: str
    inputs_at_position: str
    inputs_under_torque: str
    outputs: str
    shapes: Shapes
    links: tuple[LinkFunction, ...]


def pointers(kind: str, arrays: Iterable[str]) -> str:
    """Return declarations of array parameters; `kind` is such as const double."""
    return ", ".join(f"{kind} *{array}" for array in arrays)


def at_position(inputs: Iterable[str]) -> list[str]:
    """Return the arrays of functions that take no velocity nor acceleration."""
    return [array for array in inputs if array not in ("qd", "qdd")]


def under_torque(inputs: Iterable[str]) -> list[str]:
    """Return the arrays of functions that take torques in place of accelerations."""
    return ["tau" if array == "qdd" else array for array in inputs]


def functions(inputs: Sequence[str], robot: Span, links: Sequence[Span]) -> Iterator[Functions]:
    """Yield the functions of double, then of float; `inputs` are the arrays that every function takes."""
    for kind, suffix, block in (("double", "", "BLOCK"), ("float", "f", "BLOCKF")):
        yield Functions(
            f"All links, many samples, in {kind}",
            kind,
            suffix,
            pointers(f"const {kind}", inputs),
            pointers(f"const {kind}", (array for array in inputs if array != "qdd")),
            pointers(f"const {kind}", at_position(inputs)),
            pointers(f"const {kind}", under_torque(inputs)),
            pointers(kind, robot.size.arrays),
            Shapes(
                _motion("p" in inputs, "count, JOINTS"),
                _motion("p" in inputs, "count, JOINTS", "q, qd"),
                _shapes((array, f"count, {NUMBERS[array]}") for array in robot.size.arrays),
                _motion("p" in inputs, f"blocks, JOINTS, {block}"),
                _shapes((array, f"blocks, {NUMBERS[array]}, {block}") for array in robot.size.arrays),
                _motion("p" in inputs, "JOINTS"),
                _motion("p" in inputs, "JOINTS", "q"),
                _motion("p" in inputs, "JOINTS", "q, qd"),
                _motion("p" in inputs, "JOINTS", "q, qd, tau"),
            ),
            tuple(
                LinkFunction(
                    link.first,
                    pointers(kind, link.size.arrays),
                    _shapes((array, str(link.size.of(array))) for array in link.size.arrays),
                )
                for link in links
            ),
        )


def cost(forms: Iterable[CFormFunction]) -> int:
    """Return the additions, multiplications and divisions per sample of all these functions."""
    return sum(function.arithmetic for function in forms)


def _motion(parameters: bool, shape: str, arrays: str = "q, qd, qdd") -> str:
    return _shapes([(arrays, shape), *([("p", "PARAMETERS")] if parameters else [])])


def _shapes(shapes: Iterable[tuple[str, str]]) -> str:
    """Return arrays and their shapes, those of one shape together."""
    return ", ".join(
        f"{', '.join(array for array, _ in same)} ({shape})" for shape, same in groupby(shapes, itemgetter(1))
    )
