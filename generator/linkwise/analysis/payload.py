"""Payloads: point masses on bodies of a robot, each with partial torques of its own, as a link has them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.joint_reactions import Reactions
from linkwise_runtime.quantities import Energy
from linkwise_runtime.rule.joint_tree import JointTree, TreeFrame, TreeJoint, TreeLink

from linkwise.analysis.constrained_model import ConstrainedModel, tied_in_tree
from linkwise.analysis.named_bodies import body_frame, told_apart
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.settings import Payload
from linkwise.analysis.term_rows import NAMES, TermArrays
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.package.entries import LinkEntry
from linkwise.package.load import Package

UPRIGHT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
ORIGIN = (0.0, 0.0, 0.0)
NOTHING = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@dataclass(frozen=True)
class _Placed:
    """A payload, the link j that carries it, the joint that moves that, and its place behind it, in m."""

    payload: Payload
    link: int
    joint: int
    place: tuple[float, float, float]


def with_payloads(robot: OpenedRobot, payloads: Sequence[Payload]) -> OpenedRobot:
    """Return the robot with payloads, each behind its links as a link of its own.

    Raises LinkwiseError for a body that does not exist, stands on the ground or has no mass of its own, for
    two payloads of one name, and for a robot of energies.
    """
    if not payloads:
        return robot
    tree = robot.package.manifest.tree
    if tree is None:
        raise LinkwiseError(
            f"payload on {payloads[0].body!r}: the links of {robot.name} are energies, which do not say"
            " where anything is; payloads are for rigid links"
        )
    told_apart("payload", [payload.title for payload in payloads], [frame.name for frame in tree.frames])
    placed = [_placed(robot, tree, payload) for payload in payloads]
    loaded = _extended(tree, placed)
    return replace(
        robot,
        links=(*robot.links, *(payload.title for payload in payloads)),
        model=cast(Dynamics, PayloadModel.of(robot.model, _models(robot.package, tree, placed))),
        tree=loaded,
        recursion=_recursion(robot.package, loaded, placed),
        payloads=tuple(payloads),
    )


def _placed(robot: OpenedRobot, tree: JointTree, payload: Payload) -> _Placed:
    frame: TreeFrame = body_frame("payload on", payload.body, robot)
    joint = frame.joint
    if joint is None:
        raise LinkwiseError(f"payload on {payload.body!r}: that stands on the ground; joints do not carry it")
    link = tree.joints[joint].link
    if link not in robot.links:
        raise LinkwiseError(
            f"payload on {payload.body!r}: {link!r} has no mass in the robot's file, so that it is not a"
            " link; give it one there, or name another body"
        )
    x, y, z = np.array(frame.rotation) @ np.array(payload.point) + np.array(frame.translation)
    return _Placed(payload, robot.links.index(link), joint, (float(x), float(y), float(z)))


def _models(package: Package, tree: JointTree, placed: Sequence[_Placed]) -> list[tuple[int, Dynamics]]:
    """Return for each payload its link, and the package with nothing but that payload on that link."""
    backend = next((name for name in ("numpy", "torch") if name in package.backends), None)
    if backend is None:
        raise LinkwiseError(f"{package.called}: no back end takes a payload's mass; {package.remedy}")
    models = []
    own = package.module.bodies()
    for at in placed:
        masses, centres = np.zeros(own.masses.shape), np.zeros(own.centres.shape)
        masses[at.link], centres[at.link] = at.payload.mass, at.place
        bodies = own._replace(masses=masses, centres=centres, inertias=np.zeros(own.inertias.shape))
        model = package.load(backend, bodies=bodies)
        if tree.tied:
            model = cast(Dynamics, ConstrainedModel.of(model, tied_in_tree(tree)))
        models.append((at.link, model))
    return models


def _extended(tree: JointTree, placed: Sequence[_Placed]) -> JointTree:
    """Return the tree with each payload as a link on a joint that never moves, as its ratio is 0."""
    joints, links, frames = list(tree.joints), list(tree.links), list(tree.frames)
    for at in placed:
        name, coordinate = at.payload.title, tree.joints[at.joint].coordinate
        frames.append(TreeFrame(name, len(joints), UPRIGHT, ORIGIN))
        links.append(TreeLink(len(joints), at.payload.mass, ORIGIN, NOTHING))
        joints.append(TreeJoint(name, name, at.joint, "revolute", coordinate, 0.0, UPRIGHT, at.place))
    return replace(tree, joints=tuple(joints), links=tuple(links), frames=tuple(frames))


def _recursion(package: Package, tree: JointTree, placed: Sequence[_Placed]) -> NewtonEuler:
    links = package.manifest.links
    added = (LinkEntry(at.payload.title, links[at.link].path, 0) for at in placed)
    return NewtonEuler(replace(package.manifest, links=(*links, *added), tree=tree), tree)


@dataclass(frozen=True)
class _Part:
    """A payload's model, its link there, its number among all links, and the places of its packed values."""

    model: Dynamics
    link: int
    number: int
    columns: TermArrays


@dataclass(frozen=True)
class PayloadModel:
    """A model of the links and the payloads together, with the calls that an analysis makes."""

    own: Dynamics
    parts: tuple[_Part, ...]
    layout: TermArrays

    @classmethod
    def of(cls, own: Dynamics, payloads: Sequence[tuple[int, Dynamics]]) -> "PayloadModel":
        """Join a robot's model and those of its payloads.

        payloads: for each, the link that carries it, and the package with that payload alone
        """
        parts = []
        for number, (link, model) in enumerate(payloads, len(own.link_names)):
            columns = TermArrays(
                *(np.flatnonzero(getattr(model.layout, name)[:, 1] == link) for name in NAMES)
            )
            parts.append(_Part(model, link, number, columns))
        layouts = []
        for name in NAMES:
            rows = [np.asarray(getattr(own.layout, name))]
            for part in parts:
                there = np.array(getattr(part.model.layout, name)[getattr(part.columns, name)])
                there[:, 1] = part.number
                rows.append(there)
            layouts.append(np.concatenate(rows))
        return cls(own, tuple(parts), TermArrays(*layouts))

    def __getattr__(self, name: str) -> Any:
        """Return what payloads do not change: names, kinematics, passive torques of the joints."""
        return getattr(self.own, name)

    @property
    def open(self) -> "PayloadModel":
        """This model without ties, where joints are tied."""
        own: Any = self.own
        payloads: Any = [(part.link, part.model) for part in self.parts]
        return PayloadModel.of(own.open, [(link, model.open) for link, model in payloads])

    def packed(self, q: Array, qd: Array, qdd: Array) -> TermArrays:
        """Return all coefficients and τ_ij on the paths, packed in the order of `layout`."""
        values = [self.own.packed(q, qd, qdd), *(part.model.packed(q, qd, qdd) for part in self.parts)]
        joined = []
        for name in NAMES:
            some = [getattr(values[0], name)]
            for part, value in zip(self.parts, values[1:], strict=True):
                some.append(getattr(value, name)[..., getattr(part.columns, name)])
            joined.append(np.concatenate(some, axis=-1))
        return TermArrays(*joined)

    def energy(self, q: Array, qd: Array) -> Energy[Array]:
        """Return the kinetic and potential energies of links and payloads in J, (S, N) each."""
        found = [list(self.own.energy(q, qd))]
        found += [[e[:, [part.link]] for e in part.model.energy(q, qd)] for part in self.parts]
        return Energy(*(np.concatenate(some, axis=1) for some in zip(*found, strict=True)))

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return τ_i of links and payloads, (S, n)."""
        models = [self.own, *(part.model for part in self.parts)]
        torque: Array = np.sum([model.inverse_dynamics(q, qd, qdd) for model in models], axis=0)
        return torque

    def propagation(self, q: Array, qd: Array, qdd: Array, convention: Any = "closing") -> TermArrays:
        """Return τp_ij(q̈_k) and τp_ij(q̇_k), (S, n, N, n) each, and g_ij, (S, n, N)."""
        joined = list(self.own.propagation(q, qd, qdd, convention=convention))[:3]
        for part in self.parts:
            found = part.model.propagation(q, qd, qdd, convention=convention)
            joined = [
                np.concatenate([a, b[:, :, part.link, None]], axis=2)
                for a, b in zip(joined, found, strict=False)
            ]
        acceleration, velocity, gravity = joined
        return TermArrays(acceleration, velocity, gravity, torque=None)

    def reactions(self, q: Array, qd: Array, qdd: Array, **asked: Any) -> Reactions[Any]:
        """Return the wrenches that joints carry of links and payloads, as the package's call does."""
        own = self.own.reactions(q, qd, qdd, **asked)
        asked = {**asked, "loads": (), "passive": False}
        parts = [part.model.reactions(q, qd, qdd, **asked) for part in self.parts]
        fields = ("acceleration", "velocity", "gravity")
        joined = {
            name: np.concatenate(
                [
                    np.asarray(getattr(own, name)),
                    *(
                        np.asarray(getattr(found, name))[:, :, [part.link]]
                        for part, found in zip(self.parts, parts, strict=True)
                    ),
                ],
                axis=2,
            )
            for name in fields
        }
        return own._replace(**joined)

    def forces(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return the constraint forces due to links and payloads, (S, C, N), where there are constraints."""
        own: Any = self.own
        parts: Any = [part.model for part in self.parts]
        there = [
            model.forces(q, qd, qdd)[..., [part.link]] for model, part in zip(parts, self.parts, strict=True)
        ]
        return np.concatenate([own.forces(q, qd, qdd), *there], axis=-1)
