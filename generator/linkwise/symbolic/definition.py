"""Definition of a robot in a manifest, as rigid bodies or energies, by which its package can be checked."""

from collections.abc import Callable, Iterator
from dataclasses import astuple
from math import isfinite

import sympy as sp
from linkwise_runtime.file_joints import FileJoint
from linkwise_runtime.rule.joint_tree import JointTree, TreeCoupling, TreeFrame, TreeJoint, TreeLink
from linkwise_runtime.structure import PassiveJoint
from sympy.printing.str import StrPrinter

from linkwise.package.entries import (
    ConstraintEntry,
    EnergiesEntry,
    EnergyEntry,
    FollowerEntry,
    JointEntry,
    ShareEntry,
)
from linkwise.package.formula_symbols import motion_symbol, parameter_symbols
from linkwise.robot.robot import Scalar, Vec3
from linkwise.symbolic.system import EnergySystem, RigidSystem, System

LARGEST = 2**53
"""Largest whole number up to which all are floats; fractions of larger ones are written as decimals."""


def joint_entries(system: System) -> tuple[JointEntry, ...]:
    """Return the names, units and limits of the coordinates."""
    if not isinstance(system, RigidSystem):
        return tuple(JointEntry(c.name, c.unit) for c in system.coordinates)
    return tuple(
        JointEntry(c.name, c.unit, *(x if isfinite(x) else None for x in astuple(limits)))
        for c, limits in zip(system.coordinates, system.robot.joint_limits, strict=True)
    )


def joint_tree(system: System) -> JointTree | None:
    """Return the joints, links, frames and constraints of a robot; None for a user's own energies.

    Its numbers are those of the parameters' own values.
    """
    if not isinstance(system, RigidSystem):
        return None
    robot, values = system.robot, dict(system.parameters)

    def number(scalar: Scalar) -> float:
        return float(sp.sympify(scalar).xreplace(values))

    def numbers(a: Vec3) -> tuple[float, float, float]:
        return number(a[0]), number(a[1]), number(a[2])

    return JointTree(
        numbers(robot.gravity),
        tuple(
            TreeJoint(
                link.joint.name,
                link.name,
                link.parent,
                link.joint.kind,
                link.joint.coordinate,
                link.joint.ratio,
                link.joint.rotation,  # type: ignore[arg-type]  # three rows; the type has any number
                numbers(link.joint.translation),
                link.joint.curve,
            )
            for link in robot.links
        ),
        tuple(
            TreeLink(
                link.chain[-1],
                number(link.mass),
                numbers(link.com),
                (numbers(link.inertia[0]), numbers(link.inertia[1]), numbers(link.inertia[2])),
            )
            for link in system.links
        ),
        tuple(
            TreeFrame(
                frame.name,
                frame.link,
                frame.rotation,  # type: ignore[arg-type]  # likewise
                numbers(frame.translation),
            )
            for frame in robot.named_frames
        ),
        robot.ties,
        tuple(TreeCoupling(coupling.name, coupling.terms) for coupling in robot.couplings),
        robot.independent,
        robot.closed_position,
    )


def passive_joints(system: System) -> tuple[PassiveJoint, ...]:
    """Return the joints with springs, damping, friction or armature."""
    return system.robot.passive if isinstance(system, RigidSystem) else ()


def formula_texts(system: System) -> dict[str, str]:
    """Return formulas of the tree's numbers that depend on run-time parameters, by their place in it."""
    if not isinstance(system, RigidSystem):
        return {}
    text = _texts(system)
    return {
        place: text(value)
        for place, value in _places(system)
        if isinstance(value, sp.Expr) and value.free_symbols
    }


def follower_entries(system: System) -> tuple[FollowerEntry, ...]:
    """Return the joints of the robot's file that are no coordinates."""
    if isinstance(system, EnergySystem):
        return ()
    names = [c.name for c in system.coordinates]
    return tuple(
        FollowerEntry(
            one.name,
            one.unit,
            names.index(one.coordinate) if one.coordinate else None,
            one.curve,
        )
        for one in system.robot.followers
    )


def file_joint_entries(system: System) -> tuple[FileJoint, ...]:
    """Return the moving joints of the robot's file; none where each is one coordinate, in the same order."""
    joints = system.robot.file_joints if isinstance(system, RigidSystem) else ()
    if all(one.kind == "single" and one.pinocchio == at for at, one in enumerate(joints)):
        return ()
    return joints


def in_radians(system: System) -> tuple[str, ...]:
    """Return the names of the followers and coordinates that logs always have in radians."""
    following = system.robot.followers if isinstance(system, RigidSystem) else ()
    return (
        *(one.name for one in system.coordinates if one.coupled),
        *(one.name for one in following if one.coupled),
    )


def energies(system: System) -> EnergiesEntry | None:
    """Return the terms that a user wrote; None for rigid bodies."""
    if not isinstance(system, EnergySystem):
        return None
    text, joints = _texts(system), [c.name for c in system.coordinates]
    links = tuple(
        EnergyEntry(
            link.name,
            text(link.kinetic),
            link.degree,
            tuple(
                ShareEntry(
                    share.name,
                    text(share.potential),
                    text(share.motion),
                    text(share.dissipation),
                    {joints[i]: text(q) for i, q in share.forces.items()},
                )
                for share in link.shares
            ),
        )
        for link in system.links
    )
    time = "" if system.time is None else system.time.name
    return EnergiesEntry(
        links,
        time,
        tuple(symbol.name for symbol in system.inputs),
        tuple(ConstraintEntry(one.name, text(one.expression), one.holonomic) for one in system.constraints),
        system.independent,
        system.closed_position,
    )


def _places(system: RigidSystem) -> Iterator[tuple[str, Scalar]]:
    """Yield every number of a tree that may depend on parameters, with its place."""
    yield from _entries("gravity", system.robot.gravity)
    for f, moved in enumerate(system.robot.links):
        yield from _entries(f"joints[{f}].translation", moved.joint.translation)
    for j, link in enumerate(system.links):
        yield f"links[{j}].mass", link.mass
        yield from _entries(f"links[{j}].com", link.com)
        for i, row in enumerate(link.inertia):
            yield from _entries(f"links[{j}].inertia[{i}]", row)
    for f, frame in enumerate(system.robot.named_frames):
        yield from _entries(f"frames[{f}].translation", frame.translation)


def _entries(place: str, vector: Vec3) -> Iterator[tuple[str, Scalar]]:
    return ((f"{place}[{i}]", value) for i, value in enumerate(vector))


def _texts(system: System) -> Callable[[Scalar], str]:
    """Return a function that writes formulas in the symbols of formulas.txt, with all digits of numbers."""
    parameters = parameter_symbols([symbol.name for symbol in system.parameters])
    names = {own: sp.Symbol(shown.text) for own, shown in zip(system.parameters, parameters, strict=True)}
    for k, c in enumerate(system.coordinates, 1):
        names |= {c.q: sp.Symbol(motion_symbol("q", k).text), c.qd: sp.Symbol(motion_symbol("qd", k).text)}
    printer = _Exact()

    def text(scalar: Scalar) -> str:
        expr = sp.sympify(scalar).xreplace(names)
        long = (r for r in expr.atoms(sp.Rational) if max(abs(r.p), r.q) > LARGEST)
        return str(printer.doprint(expr.xreplace({r: sp.Float(r, 17) for r in long})))

    return text


def exact_text(expression: sp.Expr) -> str:
    """Return an expression as text, with numbers in their shortest exact form."""
    return str(_Exact().doprint(expression))


class _Exact(StrPrinter):  # type: ignore[misc]
    """Printer of numbers that Python reads back to the last bit, constants such as zeta(3) among them."""

    def _print(self, expr: sp.Basic, **options: object) -> str:
        if isinstance(expr, sp.Expr) and expr.is_number and not expr.is_Rational:
            value = float(expr)
            return f"({value!r})" if value < 0 else repr(value)
        return str(super()._print(expr, **options))
