"""Measure of how far rounding may move an answer: its change if every number of the robot is off by a little.

An answer that is found by solving equations loses as many digits as their matrix is badly conditioned, which
no bound of sums shows. Noise of a known size in all that goes in, and in what is summed of it on the way,
changes it; that change, over the size of the noise, is how large the numbers are that such an answer is
summed from.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

import numpy as np
from linkwise_runtime.rule.joint_tree import JointTree

from linkwise.arrays import Array

NOISE = 1e-11
"""Relative noise; far above rounding, and small enough for matrices that lose ten digits."""
DRAWS = 2
JOINTS = 10
"""Number of joints above which their number counts."""


def rounding_growth(joints: int) -> float:
    """Return how many times more roundings there are for so many joints, one after the other, than a few."""
    return max(1.0, joints / JOINTS)


def measure_rounding(
    answers: Callable[[JointTree], Mapping[str, Array]], tree: JointTree, losing: Array | float = 1.0
) -> tuple[dict[str, Array], dict[str, Array]]:
    """Return answers by name, samples first, and scales: each sample's largest change, for all its numbers.

    Entries of one sample share their scale, for a solution's errors are as large as its largest number's.
    losing: how much more than this the package's own way to solve may lose (samples,): to eliminate dependent
    joints multiplies by the inverse of their columns A_d twice
    """
    values = dict(answers(tree))
    scales = {what: np.zeros(len(value)) for what, value in values.items()}
    for draw in range(DRAWS):
        changed = answers(_noisy(tree, np.random.default_rng(draw)))
        for what, value in values.items():
            moved = np.abs(changed[what] - value).reshape(len(value), -1).max(-1, initial=0.0)
            scales[what] = np.maximum(scales[what], moved / NOISE)
    losing = losing * rounding_growth(len(tree.joints))
    scales = {what: scale * losing for what, scale in scales.items()}
    return values, {
        what: np.broadcast_to(scale.reshape(-1, *[1] * (values[what].ndim - 1)), values[what].shape)
        for what, scale in scales.items()
    }


@dataclass(frozen=True, kw_only=True)
class NoisyTree(JointTree):
    """A tree with noise in its numbers, with which the recursion puts noise in its sums too."""

    generator: np.random.Generator

    def rounded(self, value: Array, size: Array) -> Array:
        """Return the value with noise of the size of what it is summed from, in both parts if complex."""
        noise = NOISE * size * self.generator.standard_normal(value.shape)
        if np.iscomplexobj(value):
            noise = noise + 1j * NOISE * size * self.generator.standard_normal(value.shape)
        return value + noise


def _noisy(tree: JointTree, generator: np.random.Generator) -> NoisyTree:
    """Return the tree with NOISE in every number, by the size of the vector or matrix that it is part of."""

    def off(number: float) -> float:
        return float(number * (1.0 + NOISE * generator.standard_normal()))

    def vector(numbers: Any) -> Any:
        size = float(np.linalg.norm(numbers))
        return tuple(x + size * NOISE * generator.standard_normal() for x in numbers)

    def matrix(rows: Any) -> Any:
        size = float(np.abs(rows).max())
        noise = size * NOISE * generator.standard_normal((3, 3))
        return tuple(tuple(row) for row in (np.array(rows) + noise + noise.T).tolist())

    def turned(rows: Any) -> Any:
        noise = NOISE * generator.standard_normal((3, 3))
        return tuple(tuple(row) for row in (np.array(rows) + noise).tolist())

    joints = tuple(
        replace(
            joint,
            ratio=off(joint.ratio),
            rotation=turned(joint.rotation),
            translation=vector(joint.translation),
        )
        for joint in tree.joints
    )
    links = tuple(
        replace(link, mass=off(link.mass), com=vector(link.com), inertia=matrix(link.inertia))
        for link in tree.links
    )
    frames = tuple(
        replace(frame, rotation=turned(frame.rotation), translation=vector(frame.translation))
        for frame in tree.frames
    )
    couplings = tuple(
        replace(coupling, terms=tuple((k, tuple(map(off, factors))) for k, factors in coupling.terms))
        for coupling in tree.couplings
    )
    ties = tuple(replace(tie, length=off(tie.length)) for tie in tree.ties)
    entries = {field.name: getattr(tree, field.name) for field in fields(JointTree)}
    entries |= {"joints": joints, "links": links, "frames": frames, "couplings": couplings, "ties": ties}
    return NoisyTree(**entries | {"gravity": vector(tree.gravity)}, generator=generator)
