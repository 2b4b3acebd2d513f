"""Checks of what joints carry, by cause, against the forces and moments of the recursion."""

from collections.abc import Iterator
from typing import Any

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from linkwise_runtime.rule.joint_tree import JointTree

from linkwise.arrays import Array
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
    joints, n = chosen_joints(tree), len(manifest.joints)
    numbers = 12 * n * len(manifest.links) * len(joints)
    few = states.at(slice(max(1, min(MOST, NUMBERS // numbers))))
    wrenches, bounds = NewtonEuler(manifest, tree).wrenches, Magnitudes(manifest, tree).wrenches
    q, qd, qdd = few.motion
    rest = 0.0 * q

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
    for what, motion in (("acceleration", qdd), ("velocity", qd)):
        by_cause = motion[:, None, None, :, None]
        values[what], scales[what] = values[what] * by_cause, scales[what] * np.abs(by_cause)
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
