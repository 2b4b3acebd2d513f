"""Checks of C functions for one sample: frames, mass matrix, forward dynamics, passive torques, impedance."""

from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from linkwise_runtime.structure import PassiveJoint

from linkwise.check.compare import Entries
from linkwise.check.compiled_c import Numbers, Prototype
from linkwise.check.frame_checks import FrameReference
from linkwise.check.sum_checks import REGULAR, SHARES, SINGLE, acceleration_scales, passive_reference, regular
from linkwise.oracle.reference import Reference
from linkwise.oracle.states import States
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
"""Functions by name: the argument that is a number, the inputs before the motion, the motion, the output."""

MOST = 8
"""Most states that each function is called at."""

Call = Callable[..., dict[str, Numbers]]
"""Call of a function with its number, its inputs, sizes of its outputs, and their shift from a cache line."""


def control_prototypes(manifest: Manifest, real: str, suffix: str) -> list[Prototype]:
    """Return the functions of CONTROL, in one number type, that apply to the robot's links and joints."""
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
    """Return whether a package has a function of CONTROL.

    Tied joints do not move as those of their open tree do; most joints have no passive torques.
    """
    tree = manifest.tree
    if tree is None or (tree.tied and name.startswith("forward_dynamics")):
        return False
    return bool(manifest.passive) or name not in ("passive_torque", "forward_dynamics_of_links")


def control_calls(
    call: Call, function: Prototype, manifest: Manifest, reference: Reference, frames: FrameReference | None
) -> Iterator[Entries]:
    """Yield results of one of these functions."""
    if function.short == "mass_matrix":
        yield from _masses(call, function, reference)
    elif function.short == "passive_torque":
        yield from _passive_torques(call, function, reference, manifest.passive)
    elif function.counted != "frame":
        own = manifest.passive if function.short == "forward_dynamics" else ()
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
    call: Call, function: Prototype, reference: Reference, joints: Sequence[PassiveJoint]
) -> Iterator[Entries]:
    for row in _some(np.arange(len(reference.states.q))):
        state = reference.states.at(np.array([row]))
        given = dict(zip(("q", "qd", "qdd"), (a[0] for a in state.motion), strict=True))
        found = call(function, 0, given, {"torque": state.q.shape[-1]}, int(row) % 2)
        value, scale = (shares.sum(0) for shares in passive_reference(joints, state))
        yield Entries("p", found["torque"][None], value, scale)


def _accelerations(
    call: Call, function: Prototype, reference: Reference, joints: Sequence[PassiveJoint]
) -> Iterator[Entries]:
    """Yield accelerations under the reference's torques and the passive torques of `joints`."""
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
    """Yield Jacobians or their rates; a point at the origin may also be NULL."""
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


TARGETS = ("q_d", "qd_d", "qdd_d")
FRAME_TARGETS = ("pose_d", "velocity_d", "acceleration_d")

NOT_CALLED = "frame_partial_impedance"
"""Function that takes more than arrays: only its declaration and its presence are checked."""


def impedance_prototypes(manifest: Manifest, real: str, suffix: str) -> list[Prototype]:
    """Return impedance functions of one number type: of free joints, and of frames of rigid links."""
    tree, kind = manifest.tree, f"{manifest.name}_impedance{suffix}"
    if manifest.tied:
        return []
    state = ("q", "qd", *(["p"] if manifest.parameters else []))
    joints = Prototype(
        f"partial_impedance{suffix}",
        real,
        "",
        (*state, "wanted", *TARGETS, "task", "external"),
        ("tau", "qdd"),
        "int",
        (("wanted", kind),),
    )
    given = (*state[:2], "qdd", *state[2:])
    cancelled = Prototype(
        f"cancel{suffix}", real, "", (*given, "wanted", "task"), ("tau",), "int", (("wanted", kind),)
    )
    if tree is None:
        return [joints, cancelled]
    frame = Prototype(
        NOT_CALLED + suffix,
        real,
        "",
        (*state, "posture", *TARGETS, "wanted", *FRAME_TARGETS, "external"),
        ("tau", "qdd"),
        "int",
        (("posture", kind), ("wanted", f"{manifest.name}_frame_impedance{suffix}")),
    )
    return [joints, cancelled, frame]


def impedance_calls(
    call: Call, function: Prototype, manifest: Manifest, reference: Reference
) -> Iterator[Entries]:
    """Yield what natural impedance asks for: torques of a motion without error, and accelerations of a task.

    The first are inverse dynamics and passive torques, which `qdd` = NULL leaves unsolved. The task asks of
    joints whose wanted velocity is zero, M qdd + C qd = v, which gives qdd and again these torques.
    """
    states, none = reference.states, dict.fromkeys(("wanted", "q_d", "task", "external"))
    for row in range(0, len(states.q), max(1, len(states.q) // MOST)):
        state = states.at(row)
        given: dict[str, Any] = {"q": state.q, "qd": state.qd, "qd_d": state.qd, "qdd_d": state.qdd, **none}
        found = call(function, 0, given, {"tau": state.q.shape[-1]}, row % 2)["tau"]
        value, scale = _asked(manifest, reference, row, "tau")
        yield Entries("tau", found[None], value[None], scale[None])
    armature = passive_reference(manifest.passive, _accelerated(states))[0][SHARES.index("armature")]
    least = SINGLE if function.real == "float" else REGULAR
    for row in _some(np.flatnonzero(regular(reference, least))):
        q, qd, qdd = states.at(row).motion
        moving = (reference.values["tau"] - reference.values["g"])[row].sum(-1) + armature[row] * qdd
        given = {"q": q, "qd": qd, "qd_d": None, "qdd_d": None, **none, "task": moving}
        both = call(function, 0, given, {"tau": len(q), "qdd": len(q)}, int(row) % 2)
        value, scale = _asked(manifest, reference, row, "tau")
        sizes = acceleration_scales(reference, row, np.diag(armature[row]), scale)
        yield Entries("qdd", both["qdd"][None], qdd[None], sizes[None])
        mass = np.abs(reference.values["c2"][row].sum(1) + np.diag(armature[row]))
        yield Entries("tau", both["tau"][None], value[None], (scale + mass @ sizes)[None])


def cancel_calls(
    call: Call, function: Prototype, manifest: Manifest, reference: Reference
) -> Iterator[Entries]:
    """Yield what is left to ask for where nothing is cancelled: weight and passive torques, and a task's."""
    states = reference.states
    for row in range(0, len(states.q), max(1, len(states.q) // MOST)):
        q, qd, qdd = states.at(row).motion
        given = {"q": q, "qd": qd, "qdd": qdd, "wanted": None, "task": qdd}
        found = call(function, 0, given, {"tau": len(q)}, row % 2)["tau"]
        value, scale = _asked(manifest, reference, row, "g")
        yield Entries("tau", found[None], (value + qdd)[None], (scale + np.abs(qdd))[None])


def _accelerated(states: States) -> States:
    return States(states.q, states.qd, np.ones_like(states.q))


def _asked(manifest: Manifest, reference: Reference, row: int, what: str) -> tuple[Numbers, Numbers]:
    """Return what links, joints' springs, damping and armature ask for, with sizes; of "g" without armature.

    Compensation of friction is not asked for.
    """
    value, scale = (kept[what][row].sum(-1) for kept in (reference.values, reference.scales))
    if manifest.passive:
        taken, sizes = passive_reference(manifest.passive, reference.states.at(np.array([row])))
        left = [SHARES.index("friction"), *([SHARES.index("armature")] if what == "g" else [])]
        value = value + (taken.sum(0) - taken[left].sum(0))[0]
        scale = scale + sizes.sum(0)[0]
    return value, scale
