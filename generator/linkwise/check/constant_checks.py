"""Checks of the numbers that modules of rigid links hold, each changed, as where they are learned."""

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.rule.joint_tree import JointTree

from linkwise.check.compare import Entries, Result, compare
from linkwise.extras import extra
from linkwise.oracle.magnitudes import Magnitudes
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.oracle.states import States
from linkwise.package.manifest import Manifest

STATES = 4
CHANGED = 0.03
"""Most that a mass or an inertia changes, of its own, and a place, of the longest one, or of 1 m."""


def constant_calls(
    name: str, model: Dynamics, manifest: Manifest, tree: JointTree, states: States
) -> Iterator[Result]:
    """Change all numbers of the modules of `model`, and hold torques and poses against a robot of these."""
    few, backend = states.at(slice(STATES)), model.backend
    changed = _changed(tree, backend)
    recursion, sizes = NewtonEuler(manifest, changed), Magnitudes(manifest, changed)
    q, qd, qdd = few.motion
    at, speed, change = (np.abs(x) for x in few.motion)
    whole = [(frame.joint, np.array(frame.translation)) for frame in changed.frames]
    entries = [
        Entries(
            "tau",
            model.partial_torque(q, qd, qdd),
            recursion.partial_torque(q, qd, qdd),
            sizes.partial_torque(at, speed, change),
        ),
        Entries(
            "pose",
            model.kinematics.poses(q),
            recursion.poses(changed.frames, q),
            sizes.poses(whole, at),
        ),
    ]
    yield compare(f"{name}: other numbers of links against Newton-Euler recursion", entries)


def _changed(tree: JointTree, backend: Any) -> JointTree:
    """Return the tree with other numbers, which the modules of a back end then hold too."""
    torch, generator = extra("torch"), np.random.default_rng(7)
    joints, links = list(tree.joints), list(tree.links)
    lengths = [*(joint.translation for joint in joints), *(link.com for link in links)]
    length = float(np.abs(lengths).max()) or 1.0

    def moved(place: Any) -> Any:
        return tuple((np.array(place) + length * generator.uniform(-CHANGED, CHANGED, 3)).tolist())

    def scaled(number: Any) -> Any:
        return (np.array(number) * (1.0 + generator.uniform(-CHANGED, CHANGED))).tolist()

    def held(module: Any, key: str, value: Any) -> Any:
        with torch.no_grad():
            getattr(module, key).copy_(torch.tensor(value, dtype=torch.float64))
        return value

    for j, module in enumerate(backend.modules):
        for joint, key in module.places.items():
            at = moved(joints[joint].translation)
            joints[joint] = replace(joints[joint], translation=held(module, key, at))
        ways = {"mass": scaled, "com": moved, "inertia": scaled}
        own = {
            key: held(module, key, change(getattr(links[j], key)))
            for key, change in ways.items()
            if key in module.constants
        }
        links[j] = replace(links[j], **own)
    return replace(tree, joints=tuple(joints), links=tuple(links))
