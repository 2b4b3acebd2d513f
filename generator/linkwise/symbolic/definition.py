"""Definition of a robot in a manifest, as rigid bodies or energies, by which its package can be checked."""

from collections.abc import Callable, Iterator
from dataclasses import astuple
from math import isfinite

import sympy as sp
from linkwise_runtime.rule.joint_tree import TreeCoupling, TreeFrame
from sympy.printing.str import StrPrinter

from linkwise.package.entries import (
    BodyEntry,
    EnergiesEntry,
    EnergyEntry,
    FileJointEntry,
    FollowerEntry,
    JointEntry,
    RigidTree,
    ShareEntry,
)
from linkwise.package.formula_symbols import motion_symbol, parameter_symbols
from linkwise.robot.robot import Robot, Scalar, Vec3
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


def rigid_tree(system: System) -> RigidTree | None:
    """Return the bodies, frames, passive axes and constraints of a robot; None for a user's own energies."""
    if not isinstance(system, RigidSystem):
        return None
    robot, values = system.robot, dict(system.parameters)

    def number(scalar: Scalar) -> float:
        return float(sp.sympify(scalar).xreplace(values))

    def numbers(a: Vec3) -> tuple[float, float, float]:
        return number(a[0]), number(a[1]), number(a[2])

    text = _texts(system)
    return RigidTree(
        numbers(robot.gravity),
        tuple(
            BodyEntry(
                link.name,
                link.parent,
                link.joint.name,
                link.joint.kind,
                link.joint.coordinate,
                link.joint.ratio,
                link.joint.rotation,  # type: ignore[arg-type]  # three rows; the type has any number
                numbers(link.joint.translation),
                number(link.mass),
                numbers(link.com),
                (numbers(link.inertia[0]), numbers(link.inertia[1]), numbers(link.inertia[2])),
                link.joint.curve,
            )
            for link in robot.links
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
        robot.passive,
        robot.ties,
        tuple(TreeCoupling(coupling.name, coupling.terms) for coupling in robot.couplings),
        robot.independent,
        robot.closed_position,
        {
            place: text(value)
            for place, value in _places(robot)
            if isinstance(value, sp.Expr) and value.free_symbols
        },
    )


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


def file_joint_entries(system: System) -> tuple[FileJointEntry, ...]:
    """Return the moving joints of the robot's file; none where each is one coordinate, in the same order."""
    joints = system.robot.file_joints if isinstance(system, RigidSystem) else ()
    if all(one.kind == "single" and one.pinocchio == at for at, one in enumerate(joints)):
        return ()
    return tuple(FileJointEntry(one.name, one.kind, one.coordinates, one.pinocchio) for one in joints)


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
    return EnergiesEntry(links, time, tuple(symbol.name for symbol in system.inputs))


def _places(robot: Robot) -> Iterator[tuple[str, Scalar]]:
    """Yield every number of a tree that may depend on parameters, with its place."""
    yield from _entries("gravity", robot.gravity)
    for b, link in enumerate(robot.links):
        yield f"bodies[{b}].mass", link.mass
        yield from _entries(f"bodies[{b}].translation", link.joint.translation)
        yield from _entries(f"bodies[{b}].com", link.com)
        for i, row in enumerate(link.inertia):
            yield from _entries(f"bodies[{b}].inertia[{i}]", row)
    for f, frame in enumerate(robot.named_frames):
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


class _Exact(StrPrinter):  # type: ignore[misc]
    """Printer of numbers that Python reads back to the last bit, constants such as zeta(3) among them."""

    def _print(self, expr: sp.Basic, **options: object) -> str:
        if isinstance(expr, sp.Expr) and expr.is_number and not expr.is_Rational:
            value = float(expr)
            return f"({value!r})" if value < 0 else repr(value)
        return str(super()._print(expr, **options))
