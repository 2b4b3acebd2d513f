"""Checks of the joints' passive torques against the manifest's numbers, joint by joint."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from linkwise_runtime.dynamics import Dynamics
from numpy.typing import NDArray

from linkwise.check.compare import Entries, Result, compare, skipped
from linkwise.check.model_calls import FLOAT32
from linkwise.check.sum_checks import is_tied, regular
from linkwise.oracle.reference import Reference
from linkwise.oracle.states import States
from linkwise.package.entries import PassiveEntry
from linkwise.package.load import Array

SHARES = ("spring", "damping", "friction", "armature")


def passive_calls(
    name: str, model: Dynamics, joints: Sequence[PassiveEntry], reference: Reference
) -> Iterator[Result]:
    """Yield checks of the call for many states, for one, and in single precision.

    All values are zero where no joint has passive torques.
    """
    states = reference.states
    values, scales = passive_reference(joints, states)

    def entries(dtype: Any, rows: Any) -> Iterator[Entries]:
        motion: list[Any] = [x[rows].astype(dtype) for x in states.motion]
        found = model.passive_torque(*motion)
        for what, value, expected, scale in zip(SHARES, found, values, scales, strict=True):
            # A single state becomes a batch of one, as errors are reported by sample.
            shape = (-1, expected.shape[1])
            yield Entries(
                what,
                np.asarray(value).reshape(shape),
                expected[rows].reshape(shape),
                scale[rows].reshape(shape),
            )

    every = [*entries(float, slice(None)), *(entries(float, 0) if len(states.q) else ())]
    yield compare(f"{name}: passive torques of the joints", every)
    single = entries(np.float32, slice(None))
    yield compare(f"{name}: passive torques in single precision", single, **FLOAT32)
    if joints and len(states.q) and not is_tied(model):
        check, invertible = f"{name}: accelerations that passive torques leave", regular(reference)
        if invertible.any():
            yield compare(check, [_torques_of_accelerations(model, joints, reference, invertible)])
        else:
            yield skipped(check, "no mass matrix can be inverted here")


def _torques_of_accelerations(
    model: Dynamics, joints: Sequence[PassiveEntry], reference: Reference, at: NDArray[np.bool_]
) -> Entries:
    """Return torques given to forward dynamics beside those that its accelerations need.

    Both are summed from the torques of the links, also at rest: gravity alone has rounding.
    """
    states = reference.states.at(at)
    q, qd, qdd = states.motion
    values, scales = passive_reference(joints, states)
    tau = model.inverse_dynamics(q, qd, qdd) + values.sum(0)
    found = model.forward_dynamics(q, qd, tau)
    taken, sizes = passive_reference(joints, States(q, qd, found))
    mass = reference.scales["c2"][at].sum(2) @ (np.abs(found) + np.abs(qdd))[..., None]
    scale = reference.scales["tau"][at].sum(-1) + mass[..., 0] + scales.sum(0) + sizes.sum(0)
    return Entries("tau", model.inverse_dynamics(q, qd, found) + taken.sum(0), tau, scale)


def passive_reference(joints: Sequence[PassiveEntry], states: States) -> tuple[Array, Array]:
    """Return shares (4, samples, n), and the sizes of what they are summed from.

    For a joint at p = r q a torque f does the work f dp = r f dq: it counts r times on the coordinate.
    """
    q, qd, qdd = states.motion
    values, scales = np.zeros((2, len(SHARES), *q.shape))
    for joint in joints:
        k, r = joint.coordinate, joint.ratio
        p, pd, pdd = (r * x[:, k] for x in (q, qd, qdd))
        own = (
            joint.stiffness * (p - joint.rest),
            joint.damping * pd,
            joint.friction * np.sign(pd),
            joint.armature * pdd,
        )
        values[..., k] += r * np.stack(own)
        scales[..., k] += abs(r) * np.abs(own)
        scales[0, :, k] += abs(r * joint.stiffness) * (np.abs(p) + abs(joint.rest))
    return values, scales
