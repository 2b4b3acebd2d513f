"""Functions of C for one sample: frames, mass matrix, forward dynamics, joints' own torques."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np

from linkwise.check.compare import Entries
from linkwise.check.compiled_c import Numbers, Prototype
from linkwise.check.frame_reference import FrameReference
from linkwise.check.passive_reference import passive_reference
from linkwise.check.reference import Reference
from linkwise.check.states import States
from linkwise.check.sum_checks import REGULAR, SINGLE, acceleration_scales, regular
from linkwise.package.entries import PassiveEntry
from linkwise.package.manifest import Manifest

CONTROL = {
    "pose": ("frame", (), ("q",), "pose"),
    "jacobian": ("frame", ("point",), ("q",), "jacobian"),
    "jacobian_rate": ("frame", ("point",), ("q", "qd"), "rate"),
    "mass_matrix": ("", (), ("q",), "mass"),
    "passive_torque": ("", (), ("q", "qd", "qdd"), "torque"),
    "forward_dynamics": ("", (), ("q", "qd", "tau"), "qdd"),
    "forward_dynamics_of_links": ("", (), ("q", "qd", "tau"), "qdd"),
}
"""Functions by name: what is asked for by number, what stands before the motion, that motion, the output."""

MOST = 8
"""States that each function is called at."""

Call = Callable[..., dict[str, Numbers]]
"""A function, its number, what it is given, sizes of its outputs, and their place beside a cache line."""


def control_prototypes(manifest: Manifest, real: str, suffix: str) -> list[Prototype]:
    """These functions of one number type: those that the robot's links and joints have a use for."""
    parameters = ("p",) if manifest.parameters else ()
    return [
        Prototype(
            name + suffix,
            real,
            asked,
            (*before, *motion, *(() if name == "passive_torque" else parameters)),
            (output,),
            "int" if name.startswith("forward_dynamics") else "void",
        )
        for name, (asked, before, motion, output) in CONTROL.items()
        if _has(manifest, name)
    ]


def _has(manifest: Manifest, name: str) -> bool:
    """Joints that are tied move as their open tree does not; most have nothing of their own."""
    tree = manifest.tree
    if tree is None or (tree.tied and name.startswith("forward_dynamics")):
        return False
    return bool(tree.passive) or name not in ("passive_torque", "forward_dynamics_of_links")


def control_calls(
    call: Call, function: Prototype, manifest: Manifest, reference: Reference, frames: FrameReference | None
) -> Iterator[Entries]:
    """Calls of one of these functions."""
    passive = manifest.tree.passive if manifest.tree is not None else ()
    if function.short == "mass_matrix":
        yield from _masses(call, function, reference)
    elif function.short == "passive_torque":
        yield from _passive_torques(call, function, reference, passive)
    elif function.counted != "frame":
        own = passive if function.short == "forward_dynamics" else ()
        yield from _accelerations(call, function, reference, own)
    elif frames is not None and manifest.tree is not None:
        numbers = {frame.name: f for f, frame in enumerate(manifest.tree.frames)}
        if function.short == "pose":
            yield from _poses(call, function, numbers, frames)
        else:
            yield from _of_points(call, function, numbers, frames)


def _masses(call: Call, function: Prototype, reference: Reference) -> Iterator[Entries]:
    n = reference.states.q.shape[-1]
    for row in _some(np.arange(len(reference.states.q))):
        found = call(function, 0, {"q": reference.states.q[row]}, {"mass": n * n}, int(row) % 2)
        value, scale = (kept["c2"][row].sum(1) for kept in (reference.values, reference.scales))
        yield Entries("M", found["mass"].reshape(1, n, n), value[None], scale[None])


def _passive_torques(
    call: Call, function: Prototype, reference: Reference, joints: Sequence[PassiveEntry]
) -> Iterator[Entries]:
    for row in _some(np.arange(len(reference.states.q))):
        state = reference.states.at(np.array([row]))
        given = dict(zip(("q", "qd", "qdd"), (a[0] for a in state.motion), strict=True))
        found = call(function, 0, given, {"torque": state.q.shape[-1]}, int(row) % 2)
        value, scale = (shares.sum(0) for shares in passive_reference(joints, state))
        yield Entries("p", found["torque"][None], value, scale)


def _accelerations(
    call: Call, function: Prototype, reference: Reference, joints: Sequence[PassiveEntry]
) -> Iterator[Entries]:
    """Accelerations of the reference's torques, and of those of `joints`."""
    least = SINGLE if function.real == "float" else REGULAR
    for row in _some(np.flatnonzero(regular(reference, least))):
        state = reference.states.at(np.array([row]))
        taken, sizes = (shares.sum(0)[0] for shares in passive_reference(joints, state))
        q, qd, qdd = (a[0] for a in state.motion)
        given = {"q": q, "qd": qd, "tau": reference.values["tau"][row].sum(-1) + taken}
        found = call(function, 0, given, {"qdd": len(q)}, int(row) % 2)["qdd"]
        armature = passive_reference(joints, States(state.q, state.qd, np.ones_like(state.q)))[0][3, 0]
        scale = acceleration_scales(reference, row, np.diag(armature), sizes)
        yield Entries("qdd", found[None], qdd[None], scale[None])


def _some(rows: Numbers) -> Numbers:
    return rows[:: max(1, len(rows) // MOST)]


def _poses(
    call: Call, function: Prototype, numbers: dict[str, int], frames: FrameReference
) -> Iterator[Entries]:
    value, scale = frames.poses
    for row, q in enumerate(frames.states.q[:MOST]):
        for frame, f in numbers.items():
            found = call(function, f, {"q": q}, {"pose": 16}, row % 2)["pose"].reshape(1, 4, 4)
            yield Entries(f"pose of {frame}", found, value[row, f][None], scale[row, f][None])


def _of_points(
    call: Call, function: Prototype, numbers: dict[str, int], frames: FrameReference
) -> Iterator[Entries]:
    """Jacobians or their rates; a point at the origin may also be NULL."""
    what = function.outputs[0]
    value, scale = getattr(frames, what)
    n = frames.states.q.shape[-1]
    for row in range(min(MOST, len(frames.states.q))):
        given: dict[str, Any] = {"q": frames.states.q[row], "qd": frames.states.qd[row]}
        for f, (frame, point) in enumerate(zip(frames.chosen, frames.points, strict=True)):

            def found(at: Any, frame: str = frame, given: dict[str, Any] = given) -> Numbers:
                answer = call(function, numbers[frame], {**given, "point": at}, {what: 6 * n}, 1)
                return answer[what].reshape(1, 6, n)

            yield Entries(f"{what} of {frame}", found(point), value[row, f][None], scale[row, f][None])
            origin = found(np.zeros(3))
            yield Entries(f"{what} of {frame} without a point", found(None), origin, scale[row, f][None])
