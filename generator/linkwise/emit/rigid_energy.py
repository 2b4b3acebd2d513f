"""Contents of a rigid link's module: its numbers, and the motion of its frame from the link before.

Joints with no body between them, as those of a ball joint, are passed one after the other. A joint at the
place of the joint before it, with no body between, has no place of its own.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import sympy as sp

from linkwise.dynamics.link_forms import lowering
from linkwise.emit.printer import PythonPrinter
from linkwise.emit.straight_line import fetched, straight_line
from linkwise.escape import python_literal
from linkwise.robot.robot import Joint, Scalar
from linkwise.symbolic.link_energy import exact, letters
from linkwise.symbolic.system import RigidSystem

Lines = tuple[str, ...]


@dataclass(frozen=True)
class Constant:
    """A number, a vector or a matrix that the link's module owns: Python text in lines, and its meaning."""

    name: str
    lines: Lines
    doc: str


@dataclass(frozen=True)
class Step:
    """A joint: the labels of the frames before and behind it, its axes at q = 0, and what it needs.

    lines: those that compute its place; place: the expression, empty for none
    """

    before: str
    label: str
    joint: str
    axes: Lines
    turn: str
    slides: bool
    position: str
    speed: str
    curve: Lines
    lines: Lines
    place: str


@dataclass(frozen=True)
class RigidEnergy:
    """Text of one link."""

    parent: int | None
    constants: tuple[Constant, ...]
    places: tuple[tuple[int, str], ...]
    """Joints, counted from 0 as in tree.py, whose places are constants, and the names of these."""
    steps: tuple[Step, ...]
    gravity: tuple[Lines, str]
    """Lines, and the expression, of gravity in the axes of the base; for a link that the ground carries."""
    body: Lines
    """Lines of the method that computes mass, centre and inertia from run-time parameters; empty for none."""


def rigid_energy(system: RigidSystem, link: int) -> RigidEnergy:
    """Return the text of link `link`, which depends on links and joints of its own chain alone."""
    rigid = system.links[link]
    position = {other.chain[-1]: j for j, other in enumerate(system.links[:link])}
    carriers = [at for at in rigid.chain[:-1] if at in position]
    parent = position[carriers[-1]] if carriers else None
    passed = rigid.chain[rigid.chain.index(carriers[-1]) + 1 :] if carriers else rigid.chain
    joints = [system.robot.links[at].joint for at in passed]
    labels = [f"{link + 1}{letters(a)}" for a in range(len(joints) - 1)] + [f"{link + 1}"]
    before = [str(parent + 1 if parent is not None else 0), *labels]
    placed = [a for a, joint in enumerate(joints) if a == 0 or any(e != 0 for e in joint.translation)]
    constants, body = _numbers(system, link)
    steps, places = list[Step](), list[tuple[int, str]]()
    for a, joint in enumerate(joints):
        name = "place" if a == placed[-1] else f"place_{letters(a)}"
        step = _step(system, joint, (before[a], labels[a]), name if a in placed else "")
        if a in placed and not _hangs(joint.translation):
            frame = "the base" if before[a] == "0" else f"frame {before[a]}"
            doc = f"of {python_literal(joint.name)} in {frame}, in m"
            constants.append(Constant(name, (_vector(joint.translation),), doc))
            places.append((passed[a], name))
        steps.append(step)
    lines, gravity = _inline(system, system.robot.gravity)
    return RigidEnergy(
        parent + 1 if parent is not None else None,
        tuple(constants),
        tuple(places),
        tuple(steps),
        (lines, gravity),
        body,
    )


def _step(system: RigidSystem, joint: Joint, labels: tuple[str, str], place: str) -> Step:
    k, ratio = joint.coordinate, joint.ratio
    moved = "" if ratio == 1.0 else f"{ratio!r} * "
    lines: Lines = ()
    text = f'p.constants(self)["{place}"]' if place else ""
    if place and _hangs(joint.translation):
        lines, text = _inline(system, joint.translation)
    axes = f"AXES_{labels[1].upper()}"
    curve = f"CURVE_{labels[1].upper()}" if joint.curve else ""
    rest = f", {ratio!r}, {curve})" if curve else ")" if ratio == 1.0 else f", {ratio!r})"
    turn = f"{axes}.turn(q, {k}{rest}"
    return Step(
        *labels,
        python_literal(joint.name),
        tuple(_vector(row) for row in joint.rotation),
        f"{axes}.slide" if joint.kind == "prismatic" else turn,
        joint.kind == "prismatic",
        f"{moved}{curve}(q[{k}])" if curve else f"{moved}q[{k}]",
        f"{moved}{curve}.slope(q[{k}]) * qd[{k}]" if curve else f"{moved}qd[{k}]",
        tuple(map(repr, (joint.curve.starts, *joint.curve.pieces))) if joint.curve else (),
        lines,
        text,
    )


def _numbers(system: RigidSystem, link: int) -> tuple[list[Constant], Lines]:
    """Return mass, centre and inertia: those that are numbers, and lines for those of parameters."""
    rigid = system.links[link]
    matrix = tuple(f"    {_vector(row)}," for row in rigid.inertia) if not _hangs(*rigid.inertia) else ()
    constants = {
        "mass": Constant("mass", (_number(rigid.mass),), "in kg") if not _hangs([rigid.mass]) else None,
        "com": Constant("com", (_vector(rigid.com),), "centre of mass in m")
        if not _hangs(rigid.com)
        else None,
        "inertia": Constant("inertia", ("(", *matrix, ")"), "about it, in kg m^2") if matrix else None,
    }
    kept = [constant for constant in constants.values() if constant]
    if len(kept) == 3:
        return kept, ()
    flat = [rigid.mass, *rigid.com, *(entry for row in rigid.inertia for entry in row)]
    lower = lowering(system)[0]
    code = straight_line(lower.graph, [lower(e) for e in exact_all(flat)], PythonPrinter("torch"))
    mass, *rest = code.outputs
    com, *rows = (f"({', '.join(rest[at : at + 3])})" for at in (0, 3, 6, 9))
    texts = {"mass": mass, "com": com, "inertia": f"({', '.join(rows)})"}
    owned = {name: f'p.constants(self)["{name}"]' for name, constant in constants.items() if constant}
    assigned = [f"{name} = {text}" for name, text in code.assignments]
    parts = [f"    {owned.get(name, text)}," for name, text in texts.items()]
    return kept, (*fetched(system, code), *assigned, "return (", *parts, ")")


def exact_all(values: Iterable[Scalar]) -> list[Scalar]:
    """Return fractions for floats, as `exact` makes them."""
    return [exact((value, 0, 0))[0] for value in values]


def _inline(system: RigidSystem, vector: Sequence[Scalar]) -> tuple[Lines, str]:
    """Return the lines that compute a vector's components, and the vector."""
    lower = lowering(system)[0]
    code = straight_line(lower.graph, [lower(e) for e in exact_all(vector)], PythonPrinter("torch"))
    assigned = (f"{name} = {text}" for name, text in code.assignments)
    return (*fetched(system, code), *assigned), f"({', '.join(code.outputs)})"


def _hangs(*vectors: Sequence[Scalar]) -> bool:
    """Return whether a number among these depends on run-time parameters."""
    return any(isinstance(e, sp.Expr) and bool(e.free_symbols) for vector in vectors for e in vector)


def _number(value: Scalar) -> str:
    return repr(float(value) + 0.0)


def _vector(values: Iterable[Scalar]) -> str:
    return f"({', '.join(map(_number, values))})"
