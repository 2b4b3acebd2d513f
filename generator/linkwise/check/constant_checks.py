"""Checks of the numbers that modules of rigid links hold, each changed, as where they are learned."""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any, cast

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.rule.joint_tree import JointTree

from linkwise.check.compare import Entries, Result, compare
from linkwise.extras import extra
from linkwise.oracle.magnitudes import Magnitudes
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.oracle.states import States
from linkwise.package.manifest import Manifest

BODY = ("mass", "com", "inertia")
STATES = 4
CHANGED = 0.03
"""Most that a mass or an inertia changes, of its own, and a place, of the longest one, or of 1 m."""


def constant_calls(
    name: str, model: Dynamics, manifest: Manifest, tree: JointTree, states: States
) -> Iterator[Result]:
    """Hold the numbers of the modules of `model`, then change them all, and ask for torques and poses."""
    few, backend = states.at(slice(STATES)), cast(Any, model.backend)
    told = f"{name}: numbers of links as the manifest has them"
    if wrong := [j for j, module in enumerate(backend.modules) if not _are_placed(module, _passed(tree, j))]:
        yield Result(told, False, None, f"places of {tree.link_name(wrong[0])} are not those of its joints")
    else:
        yield compare(told, _numbers(tree, backend))
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


def _numbers(tree: JointTree, backend: Any) -> Iterator[Entries]:
    """Yield the numbers that modules hold, some of which no torque tells, and the axes of their joints."""
    torch = extra("torch")
    seen = backend.seen_by(torch.zeros(1, dtype=torch.float64))
    # Of run-time parameters, and of merged bodies, numbers are summed from others as large as these.
    length, mass = _longest(tree), max(abs(link.mass) for link in tree.links)
    inertia = max(float(np.abs(link.inertia).max()) for link in tree.links)
    sizes = (mass, length, inertia + mass * length**2)
    for j, (module, link) in enumerate(zip(backend.modules, tree.links, strict=True)):
        body, held = zip(BODY, module.body(seen), sizes, strict=True), module.constants
        told = [(key, value, getattr(link, key), size) for key, value, size in body]
        for joint, key in module.places.items():
            told.append((key, seen.constants(module)[key], tree.joints[joint].translation, length))
        for key, value, expected, size in told:
            found, own = np.array(_plain(value))[None], np.array(expected)[None]
            yield Entries(f"{key} of {tree.link_name(j)}", found, own, np.full(1, key not in held and size))
        passed = _passed(tree, j)
        axes = [value for value in vars(sys.modules[type(module).__module__]).values() if _is_axes(value)]
        turns = np.array([_rotation(value) for value in axes])
        expected = np.array([tree.joints[joint].rotation for joint in passed])
        yield Entries(f"axes of {tree.link_name(j)}", turns, expected, np.zeros(1))


def _plain(value: Any) -> Any:
    """Return numbers, nested, of which some may be tensors."""
    return [_plain(item) for item in value] if isinstance(value, Sequence) else float(value)


def _longest(tree: JointTree) -> float:
    lengths = [*(joint.translation for joint in tree.joints), *(link.com for link in tree.links)]
    return float(np.abs(lengths).max())


def _passed(tree: JointTree, j: int) -> tuple[int, ...]:
    """Return the joints between link j and the link that carries it."""
    carried, chain = {link.joint for link in tree.links}, tree.chain(tree.links[j].joint)
    return chain[max((a + 1 for a, joint in enumerate(chain[:-1]) if joint in carried), default=0) :]


def _are_placed(module: Any, passed: Sequence[int]) -> bool:
    """Return whether each place that a module holds is that of one of its own joints."""
    held = [key for key in module.constants if key not in BODY]
    return sorted(module.places.values()) == sorted(held) and {*module.places} <= {*passed}


def _is_axes(value: object) -> bool:
    """Return whether a link's file has here the axes of a joint, of a class that a package may carry."""
    return type(value).__name__ == "Axes"


def _rotation(axes: Any) -> list[list[float]]:
    """Return R (3, 3) by R^T e of unit vectors e."""
    return [[sign * at for sign, at in axes.along(unit)] for unit in np.eye(3)]


def _changed(tree: JointTree, backend: Any) -> JointTree:
    """Return the tree with other numbers, which the modules of a back end then hold too."""
    torch, generator = extra("torch"), np.random.default_rng(7)
    joints, links = list(tree.joints), list(tree.links)
    length = _longest(tree) or 1.0

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
        ways = dict(zip(BODY, (scaled, moved, scaled), strict=True))
        own = {
            key: held(module, key, change(getattr(links[j], key)))
            for key, change in ways.items()
            if key in module.constants
        }
        links[j] = replace(links[j], **own)
    return replace(tree, joints=tuple(joints), links=tuple(links))
