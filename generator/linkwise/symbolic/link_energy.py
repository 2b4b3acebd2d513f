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

from dataclasses import dataclass

import sympy as sp

from linkwise.robot.robot import Coordinate, Joint, Mat3, Robot, Scalar, Vec3
from linkwise.symbolic.system import Definition, LinkEnergy, RigidBody, Steps, System

HALF = sp.Rational(1, 2)


@dataclass(frozen=True)
class _Motion:
    """State carried along the path, in the frame of the link reached."""

    omega: Vec3
    v: Vec3
    gravity: Vec3
    height: Scalar


class _Named(sp.Symbol):  # type: ignore[misc]
    """Symbol of a definition, which no parameter of the same name equals."""


class _Namer:
    """Collects definitions: `name` returns a symbol for anything but a number."""

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


def link_energies(robot: Robot) -> System:
    """Write the energy of every link that carries mass; parents' definitions are continued, not repeated."""
    states: dict[int, _Motion] = {}
    position: dict[int, int] = {}
    links: list[LinkEnergy] = []
    heavy = [index for index, link in enumerate(robot.links) if not link.massless]
    start = _Motion((0, 0, 0), (0, 0, 0), robot.gravity, sp.S.Zero)
    for number, index in enumerate(heavy):
        link, chain = robot.links[index], robot.chain(index)
        ancestors = [at for at in chain[:-1] if at in states]
        parent = ancestors[-1] if ancestors else None
        steps = chain[chain.index(parent) + 1 :] if parent is not None else chain
        state = states[parent] if parent is not None else start
        twist, height = _Namer(), _Namer()
        for at in steps:
            label = f"{number + 1}" if at == index else f"{number + 1}{_letters(steps.index(at))}"
            state = _step(state, robot.links[at].joint, robot.coordinates, label, twist, height)
        states[index], position[index] = state, number
        m, c, a = link.mass, link.com, state.gravity
        potential = m * (state.height - sum(x * y for x, y in zip(a, c, strict=True)))
        links.append(
            LinkEnergy(
                link.name,
                _kinetic(state, m, c, link.inertia),
                sp.sympify(potential),
                position[parent] if parent is not None else None,
                twist.steps(*state.omega, *state.v),
                height.steps(*a, state.height),
                RigidBody(chain, robot.joints_to(index), m, c, link.inertia, robot.gravity),
            )
        )
    parameters = {sp.Symbol(name, real=True): value for name, value in robot.parameters}
    return System(robot.name, robot.coordinates, tuple(links), parameters, robot)


def _letters(index: int) -> str:
    """a, b, …, z, ba, …: tells massless joints before one link apart."""
    head, last = divmod(index, 26)
    return (_letters(head) if head else "") + chr(ord("a") + last)


def _step(
    state: _Motion,
    joint: Joint,
    coordinates: tuple[Coordinate, ...],
    label: str,
    twist: _Namer,
    height: _Namer,
) -> _Motion:
    coordinate = coordinates[joint.coordinate]
    angle, rate = joint.ratio * coordinate.q, joint.ratio * coordinate.qd
    if joint.ratio == 1.0:
        angle, rate = coordinate.q, coordinate.qd
    axis = joint.rotation[0][2], joint.rotation[1][2], joint.rotation[2][2]
    p = joint.translation
    if joint.kind == "prismatic":
        p = _map(lambda t, z: t + _times(z, angle), p, axis)
    moved = _map(lambda a, b: a + b, state.v, _cross(state.omega, p))
    omega = _transposed(joint.rotation, state.omega)
    v = _transposed(joint.rotation, moved)
    gravity = _transposed(joint.rotation, state.gravity)
    u = state.height - sum(x * y for x, y in zip(state.gravity, p, strict=True))
    spin = (0, 0, rate)
    if joint.kind == "revolute":
        omega = _map(lambda a, b: a + b, _turned(twist, label, angle, omega), spin)
        v = _turned(twist, label, angle, v)
        gravity = _turned(height, label, angle, gravity)
    else:
        v = _map(lambda a, b: a + b, v, spin)
    return _Motion(
        twist.vector(f"w{label}", omega),
        twist.vector(f"v{label}", v),
        height.vector(f"a{label}", gravity),
        height.name(f"u{label}", u),
    )


def _turned(namer: _Namer, label: str, angle: sp.Expr, a: Vec3) -> Vec3:
    """Rz(angle)ᵀ a."""
    if a[0] == 0 and a[1] == 0:
        return a
    s, c = _Named(f"s{label}", real=True), _Named(f"c{label}", real=True)
    if (s, sp.sin(angle)) not in namer.definitions:
        namer.definitions += [(s, sp.sin(angle)), (c, sp.cos(angle))]
    return c * a[0] + s * a[1], c * a[1] - s * a[0], a[2]


def _kinetic(state: _Motion, m: Scalar, c: Vec3, inertia: Mat3) -> sp.Expr:
    """½ m v·v + m v·(ω × c) + ½ ω·I ω, I = inertia about the frame's origin (parallel axes)."""
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


def _times(number: float, a: Scalar) -> Scalar:
    """number · a, without leaving factors 0.0 and 1.0 behind."""
    if number == 0.0:
        return sp.S.Zero
    return a if number == 1.0 else -a if number == -1.0 else number * a


def _dot(a: Vec3, b: Vec3) -> sp.Expr:
    return sum((x * y for x, y in zip(a, b, strict=True)), sp.S.Zero)


def _cross(a: Vec3, b: Vec3) -> Vec3:
    return (
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    )


def _transposed(rotation: tuple[tuple[float, ...], ...], a: Vec3) -> Vec3:
    """Return rotationᵀ a."""
    x, y, z = (sum(_times(rotation[i][k], a[i]) for i in range(3)) for k in range(3))
    return x, y, z
