"""Payloads: point masses on bodies of a robot, each with partial torques of its own, as a link has them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.rule.joint_tree import TreeFrame

from linkwise.analysis.body_names import body_frame, told_apart
from linkwise.analysis.constrained_model import ConstrainedModel
from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.analysis.payload_model import PayloadModel
from linkwise.analysis.settings import Payload
from linkwise.errors import LinkwiseError
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.package.load import Package
from linkwise.package.manifest import BodyEntry, LinkEntry, RigidTree

UPRIGHT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
NOTHING = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))


@dataclass(frozen=True)
class _Placed:
    """A payload, the link j that carries it, that link's body, and its place in that link's frame, in m."""

    payload: Payload
    link: int
    body: int
    place: tuple[float, float, float]


def carrying(robot: LoadedRobot, payloads: Sequence[Payload]) -> LoadedRobot:
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
        bodies=loaded.bodies,
        recursion=_recursion(robot.package, loaded, placed),
        payloads=tuple(payloads),
    )


def _placed(robot: LoadedRobot, tree: RigidTree, payload: Payload) -> _Placed:
    frame: TreeFrame = body_frame("payload on", payload.body, robot)
    body = frame.joint
    if body is None:
        raise LinkwiseError(f"payload on {payload.body!r}: that stands on the ground; joints do not carry it")
    link = tree.bodies[body].link
    if link not in robot.links:
        raise LinkwiseError(
            f"payload on {payload.body!r}: {link!r} has no mass in the robot's file, so that it is not a"
            " link; give it one there, or name another body"
        )
    x, y, z = np.array(frame.rotation) @ np.array(payload.point) + np.array(frame.translation)
    return _Placed(payload, robot.links.index(link), body, (float(x), float(y), float(z)))


def _models(package: Package, tree: RigidTree, placed: Sequence[_Placed]) -> list[tuple[int, Dynamics]]:
    """Return for each payload its link, and the package with nothing but that payload on that link."""
    backend = next((name for name in ("numpy", "torch") if name in package.backends), None)
    if backend is None:
        raise LinkwiseError(
            f"{package.directory}: no back end takes a payload's mass; generate the robot again, with"
            " --backend numpy beside the others"
        )
    models = []
    own = package.module.bodies()
    for at in placed:
        masses, centres = np.zeros(own.masses.shape), np.zeros(own.centres.shape)
        masses[at.link], centres[at.link] = at.payload.mass, at.place
        bodies = own._replace(masses=masses, centres=centres, inertias=np.zeros(own.inertias.shape))
        model = package.load(backend, bodies=bodies)
        if tree.tied:
            model = cast(Dynamics, ConstrainedModel.of(model, tree))
        models.append((at.link, model))
    return models


def _extended(tree: RigidTree, placed: Sequence[_Placed]) -> RigidTree:
    """Return the tree with each payload as a body on a joint that never moves, as its ratio is 0."""
    masses = tuple(
        BodyEntry(
            link=at.payload.title,
            parent=at.body,
            joint=at.payload.title,
            kind="revolute",
            coordinate=tree.bodies[at.body].coordinate,
            ratio=0.0,
            rotation=UPRIGHT,
            translation=at.place,
            mass=at.payload.mass,
            com=(0.0, 0.0, 0.0),
            inertia=NOTHING,
        )
        for at in placed
    )
    frames = tuple(
        TreeFrame(mass.link, at, UPRIGHT, (0.0, 0.0, 0.0)) for at, mass in enumerate(masses, len(tree.bodies))
    )
    return replace(tree, bodies=(*tree.bodies, *masses), frames=(*tree.frames, *frames))


def _recursion(package: Package, tree: RigidTree, placed: Sequence[_Placed]) -> NewtonEuler:
    links = package.manifest.links
    added = (LinkEntry(at.payload.title, links[at.link].path, 0) for at in placed)
    return NewtonEuler(replace(package.manifest, links=(*links, *added), tree=tree), tree)
