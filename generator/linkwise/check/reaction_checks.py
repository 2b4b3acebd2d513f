"""Checks of what joints carry, by cause, against the forces and moments of the recursion."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.rule.joint_tree import JointTree

from linkwise.arrays import Array, Index
from linkwise.check.compare import Entries, Result, compare
from linkwise.check.model_calls import FLOAT32
from linkwise.oracle.magnitudes import Magnitudes
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.oracle.reference import TOLERANCE, Reference, by_unit
from linkwise.oracle.states import NUMBERS, States
from linkwise.package.manifest import Manifest

MOST, MOST_JOINTS = 6, 5
"""Most states, and most joints of the tree."""
SHARES = ("acceleration", "velocity", "gravity")


def chosen_joints(tree: JointTree) -> list[int]:
    """Return the indices of the joints whose reactions are checked, from the first to the last."""
    count = len(tree.joints)
    return sorted({int(f) for f in np.linspace(0, count - 1, min(count, MOST_JOINTS))})


def reaction_reference(manifest: Manifest, tree: JointTree, states: States) -> Reference:
    """Return the shares of some joints' wrenches in the world's axes, at the first few states."""
    found = _shares(manifest, tree, states, chosen_joints(tree))
    values, scales = dict(found.values), dict(found.scales)
    for what, motion in (("acceleration", found.states.qdd), ("velocity", found.states.qd)):
        by_cause = motion[:, None, None, :, None]
        values[what], scales[what] = values[what] * by_cause, scales[what] * np.abs(by_cause)
    return replace(found, values=values, scales=scales)


def link_reference(manifest: Manifest, tree: JointTree, rows: Index, states: States) -> Reference:
    """Return the wrenches of links about the joints that move them, as C has them.

    rows: joint and link of each entry of tau, (count, 2); those by a joint's motion stand where its tau does
    """
    found = _shares(manifest, tree, states, [None])
    k, j = rows.T

    def packed(source: Mapping[str, Array]) -> dict[str, Array]:
        motions = {what: source[what][:, 0, j, k] for what in SHARES[:2]}
        return {**motions, "gravity": source["gravity"][:, 0]}

    return replace(found, values=packed(found.values), scales=packed(found.scales))


def _shares(manifest: Manifest, tree: JointTree, states: States, joints: Sequence[int | None]) -> Reference:
    """Return wrenches per acceleration and per velocity, (samples, joints, N, n, 6), and of gravity."""
    numbers = 12 * len(manifest.joints) * len(manifest.links) * len(joints)
    few = states.at(slice(max(1, min(MOST, NUMBERS // numbers))))
    wrenches, bounds = NewtonEuler(manifest, tree).wrenches, Magnitudes(manifest, tree).wrenches
    q, rest = few.q, 0.0 * few.q

    def moving(q: Array, qd: Array) -> Array:
        return bounds(joints, q, qd, 0.0 * q, gravity=False)

    values = {
        "acceleration": by_unit(lambda q, qd, _, e: wrenches(joints, q, 0.0 * qd, e, gravity=False), few),
        "velocity": by_unit(
            lambda q, qd, _, e: 0.5 * wrenches(joints, q, qd + 1j * e, 0.0 * q, gravity=False).imag, few
        ),
        "gravity": wrenches(joints, q, rest, rest),
    }
    most = States(*(np.abs(x) for x in few.motion))
    scales = {
        "acceleration": by_unit(lambda q, qd, _, e: bounds(joints, q, 0.0 * qd, e, gravity=False), most),
        # The bound B is quadratic in qd: 1/2 dB/dqd_k = 1/2 (B(qd + e_k) - B(qd) - B(e_k)).
        "velocity": by_unit(
            lambda q, qd, _, e: 0.5 * (moving(q, qd + e) - moving(q, qd) - moving(q, e)), most
        ),
        "gravity": bounds(joints, most.q, rest, rest),
    }
    return Reference("Newton-Euler recursion", TOLERANCE, few, values, scales)


def reaction_calls(name: str, model: Dynamics, tree: JointTree, reference: Reference) -> Iterator[Result]:
    """Yield checks of a back end's reactions, at the reference's states and in single precision."""
    asked: dict[str, Any] = {"axes": "world", "joints": chosen_joints(tree), "constraints": False}

    def entries(kind: type, rows: Any) -> Iterator[Entries]:
        motion: list[Any] = [a.astype(kind) for a in reference.states.at(rows).motion]
        found = model.reactions(*motion, **asked)
        for what in SHARES:
            expected, scale = (source[what][rows] for source in (reference.values, reference.scales))
            yield Entries(what, np.asarray(getattr(found, what)), expected, scale)

    every = slice(None)
    yield compare(
        f"{name}: reactions of joints against {reference.name}",
        entries(np.float64, every),
        reference.tolerance,
    )
    fitting = np.flatnonzero(reference.fits_single())
    yield compare(f"{name}: reactions in single precision", entries(np.float32, fitting), **FLOAT32)
