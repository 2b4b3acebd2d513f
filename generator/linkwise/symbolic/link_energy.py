"""Energies of a rigid link, through named kinematic definitions in its own frame.

Going from a parent's frame to the link's, the angular velocity ω, the velocity v of the frame's origin, the
gravity vector a and the potential per mass of the origin u follow
    ω ← Eᵀ ω + z q̇          v ← Eᵀ (v + ω × p) + z q̇ (prismatic)
    u ← u − a · p            a ← Eᵀ a
with E the rotation and p the translation of the joint, after which
    K = ½ m v·v + m v·(ω × c) + ½ ω·I ω      (I about the frame's origin)
    P = m (u − a·c).
Every component that is not a number gets a name, so no expression grows with the length of the chain.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeAlias

import sympy as sp

from linkwise.robot.robot import Coordinate, Joint, Mat3, Scalar, Vec3
from linkwise.robot.transforms import total
from linkwise.symbolic.system import EnergySystem, System, refuse_curves

HALF = sp.Rational(1, 2)

Definition: TypeAlias = tuple[sp.Symbol, sp.Expr]


@dataclass(frozen=True)
class Steps:
    """Named definitions in order, each in terms of earlier ones; links further out may use `exports`."""

    definitions: tuple[Definition, ...] = ()
    exports: tuple[sp.Symbol, ...] = ()


@dataclass(frozen=True)
class StepwiseEnergy:
    """Kinetic and potential energy of one link in J, in steps that keep every expression short.

    `kinetic` may use the symbols of `twist`, `potential` those of `height`: they continue the exports of link
    `parent`, so that a long chain is never written out. Energies that a user wrote have no steps.
    """

    name: str
    kinetic: sp.Expr
    potential: sp.Expr
    parent: int | None = None
    twist: Steps = Steps()
    height: Steps = Steps()


@dataclass(frozen=True)
class _FrameState:
    """State carried along the path, in the frame of the link reached."""

    omega: Vec3
    v: Vec3
    gravity: Vec3
    height: Scalar


class _Named(sp.Symbol):  # type: ignore[misc]
    """Symbol of a definition; no parameter of the same name equals it."""


class _Namer:
    """Collector of definitions: `name` returns a symbol for anything but a number."""

    def __init__(self) -> None:
        self.definitions: list[Definition] = []

    def name(self, text: str, expr: sp.Expr) -> sp.Expr:
        expr = sp.sympify(expr)
        if expr.is_number:
            return expr
        symbol = _Named(text, real=True)
        self.definitions.append((symbol, expr))
        return symbol

    def vector(self, text: str, exprs: Vec3) -> Vec3:
        x, y, z = (self.name(f"{text}_{axis}", e) for axis, e in zip("xyz", exprs, strict=True))
        return x, y, z

    def steps(self, *state: Scalar) -> Steps:
        """Return the definitions, with the symbols of the state reached as exports."""
        return Steps(tuple(self.definitions), tuple(s for s in state if isinstance(s, sp.Symbol)))


def link_energies(system: System) -> tuple[StepwiseEnergy, ...]:
    """Return the energy of every link; a rigid link continues its parent's steps and does not repeat them.

    Raises LinkwiseError for joints that follow curves.
    """
    refuse_curves(system)
    if isinstance(system, EnergySystem):
        return tuple(
            StepwiseEnergy(link.name, sp.Add(link.kinetic, *link.motions), link.potential)
            for link in system.links
        )
    robot = system.robot
    states: dict[int, _FrameState] = {}
    position: dict[int, int] = {}
    energies: list[StepwiseEnergy] = []
    start = _FrameState((0, 0, 0), (0, 0, 0), exact(robot.gravity), sp.S.Zero)
    for number, rigid in enumerate(system.links):
        chain, index = rigid.chain, rigid.chain[-1]
        ancestors = [at for at in chain[:-1] if at in states]
        parent = ancestors[-1] if ancestors else None
        steps = chain[chain.index(parent) + 1 :] if parent is not None else chain
        state = states[parent] if parent is not None else start
        twist, height = _Namer(), _Namer()
        for at in steps:
            label = f"{number + 1}" if at == index else f"{number + 1}{letters(steps.index(at))}"
            state = _step(state, robot.links[at].joint, robot.coordinates, label, twist, height)
        states[index], position[index] = state, number
        (mass, _, _), com = exact((rigid.mass, 0, 0)), exact(rigid.com)
        inertia = exact(rigid.inertia[0]), exact(rigid.inertia[1]), exact(rigid.inertia[2])
        potential = mass * (state.height - _dot(state.gravity, com))
        energies.append(
            StepwiseEnergy(
                rigid.name,
                _kinetic(state, mass, com, inertia),
                sp.sympify(potential),
                position[parent] if parent is not None else None,
                twist.steps(*state.omega, *state.v),
                height.steps(*state.gravity, state.height),
            )
        )
    return tuple(energies)


def lineage(energies: Sequence[StepwiseEnergy], link: int) -> tuple[StepwiseEnergy, ...]:
    """Return the energies on whose steps that of link `link` builds, oldest first, itself last."""
    chain: list[StepwiseEnergy] = []
    at: int | None = link
    while at is not None:
        chain.append(energies[at])
        at = energies[at].parent
    return tuple(reversed(chain))


def exact(a: Sequence[Scalar]) -> Vec3:
    """Return fractions for floats, as they print: 0.6 · 0.125 is then 0.075 and not the float beside it."""
    x, y, z = (sp.Rational(repr(float(e))) if isinstance(e, (int, float)) else e for e in a)
    return x, y, z


def letters(index: int) -> str:
    """Return a, b, …, z, ba, … for 0, 1, …: they distinguish the massless joints before one link."""
    head, last = divmod(index, 26)
    return (letters(head) if head else "") + chr(ord("a") + last)


def _step(
    state: _FrameState,
    joint: Joint,
    coordinates: tuple[Coordinate, ...],
    label: str,
    twist: _Namer,
    height: _Namer,
) -> _FrameState:
    coordinate = coordinates[joint.coordinate]
    ratio, _, _ = exact((joint.ratio, 0, 0))
    angle, rate = ratio * coordinate.q, ratio * coordinate.qd
    rotation = exact(joint.rotation[0]), exact(joint.rotation[1]), exact(joint.rotation[2])
    axis = rotation[0][2], rotation[1][2], rotation[2][2]
    p = exact(joint.translation)
    if joint.kind == "prismatic":
        p = _map(lambda t, z: t + z * angle, p, axis)
    moved = _map(lambda a, b: a + b, state.v, _cross(state.omega, p))
    omega = _transposed(rotation, state.omega)
    v = _transposed(rotation, moved)
    gravity = _transposed(rotation, state.gravity)
    u = state.height - _dot(state.gravity, p)
    spin = (0, 0, rate)
    if joint.kind == "revolute":
        # sin3 is the sine of joint 3 itself, sin3_5 that of the joint before link 5 which follows it.
        turn = f"{joint.coordinate + 1}" if joint.ratio == 1.0 else f"{joint.coordinate + 1}_{label}"
        omega = _map(lambda a, b: a + b, _turned(twist, turn, angle, omega), spin)
        v = _turned(twist, turn, angle, v)
        gravity = _turned(height, turn, angle, gravity)
    else:
        v = _map(lambda a, b: a + b, v, spin)
    return _FrameState(
        twist.vector(f"w{label}", omega),
        twist.vector(f"v{label}", v),
        height.vector(f"a{label}", gravity),
        height.name(f"u{label}", u),
    )


def _turned(namer: _Namer, label: str, angle: sp.Expr, a: Vec3) -> Vec3:
    """Return Rz(angle)ᵀ a."""
    if a[0] == 0 and a[1] == 0:
        return a
    s, c = _Named(f"sin{label}", real=True), _Named(f"cos{label}", real=True)
    if (s, sp.sin(angle)) not in namer.definitions:
        namer.definitions += [(s, sp.sin(angle)), (c, sp.cos(angle))]
    return c * a[0] + s * a[1], c * a[1] - s * a[0], a[2]


def _kinetic(state: _FrameState, m: Scalar, c: Vec3, inertia: Mat3) -> sp.Expr:
    """Return ½ m v·v + m v·(ω × c) + ½ ω·I ω, I = inertia about the frame's origin (parallel axes)."""
    w, v = state.omega, state.v
    cc = _dot(c, c)
    about_origin = [
        [inertia[i][k] - m * c[i] * c[k] + (m * cc if i == k else 0) for k in range(3)] for i in range(3)
    ]
    spin = sum(HALF * about_origin[i][i] * w[i] ** 2 for i in range(3)) + sum(
        about_origin[i][k] * w[i] * w[k] for i, k in ((0, 1), (0, 2), (1, 2))
    )
    return HALF * m * _dot(v, v) + m * _dot(v, _cross(w, c)) + spin


def _map(function, a: Vec3, b: Vec3) -> Vec3:  # type: ignore[no-untyped-def]
    x, y, z = (function(p, q) for p, q in zip(a, b, strict=True))
    return x, y, z


def _dot(a: Vec3, b: Vec3) -> sp.Expr:
    return sum((x * y for x, y in zip(a, b, strict=True)), sp.S.Zero)


def _cross(a: Vec3, b: Vec3) -> Vec3:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def _transposed(rotation: Mat3, a: Vec3) -> Vec3:
    """Return rotationᵀ a."""
    x, y, z = (total(rotation[i][k] * a[i] for i in range(3)) for k in range(3))
    return x, y, z
