"""Functions of C for one sample: frames, mass matrix and forward dynamics, against the reference."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from linkwise.check.compare import Entries
from linkwise.check.compiled_c import Numbers, Prototype
from linkwise.check.frame_reference import FrameReference
from linkwise.check.reference import Reference
from linkwise.check.sum_checks import REGULAR, acceleration_scales, regular
from linkwise.package.manifest import Manifest

CONTROL = {
    "pose": ("frame", (), ("q",), "pose"),
    "jacobian": ("frame", ("point",), ("q",), "jacobian"),
    "jacobian_rate": ("frame", ("point",), ("q", "qd"), "rate"),
    "mass_matrix": ("", (), ("q",), "mass"),
    "forward_dynamics": ("", (), ("q", "qd", "tau"), "qdd"),
}
"""Functions by name: what is asked for by number, what stands before the motion, that motion, the output."""

MOST = 8
"""States that each function is called at."""
SINGLE = 1e-3
"""Least eigenvalue, as `REGULAR`, from which accelerations are looked at in single precision."""

Call = Callable[..., dict[str, Numbers]]
"""A function, its number, what it is given, sizes of its outputs, and their place beside a cache line."""


def control_prototypes(real: str, suffix: str, inputs: tuple[str, ...]) -> list[Prototype]:
    """These functions of one number type; `inputs` are the arrays of those that take all of them."""
    parameters = tuple(what for what in inputs if what == "p")
    return [
        Prototype(
            name + suffix,
            real,
            asked,
            (*before, *motion, *parameters),
            (output,),
            "int" if name == "forward_dynamics" else "void",
        )
        for name, (asked, before, motion, output) in CONTROL.items()
    ]


def control_calls(
    call: Call, function: Prototype, manifest: Manifest, reference: Reference, frames: FrameReference | None
) -> Iterator[Entries]:
    """Calls of one of these functions."""
    if function.counted != "frame":
        yield from _sums(call, function, reference)
    elif frames is not None and manifest.tree is not None:
        numbers = {frame.name: f for f, frame in enumerate(manifest.tree.frames)}
        if function.short == "pose":
            yield from _poses(call, function, numbers, frames)
        else:
            yield from _of_points(call, function, numbers, frames)


def _sums(call: Call, function: Prototype, reference: Reference) -> Iterator[Entries]:
    """Mass matrices; of forward dynamics, accelerations of the reference's torques."""
    states, mass = reference.states, function.short == "mass_matrix"
    least = SINGLE if function.real == "float" else REGULAR
    every = np.arange(len(states.q)) if mass else np.flatnonzero(regular(reference, least))
    n = states.q.shape[-1]
    for row in every[:: max(1, len(every) // MOST)]:
        state = states.at(row)
        given = {"q": state.q, "qd": state.qd, "tau": reference.values["tau"][row].sum(-1)}
        found = call(function, 0, given, {function.outputs[0]: n * n if mass else n}, int(row) % 2)
        if mass:
            value, scale = (kept["c2"][row].sum(1) for kept in (reference.values, reference.scales))
            yield Entries("M", found["mass"].reshape(1, n, n), value[None], scale[None])
        else:
            yield Entries(
                "qdd", found["qdd"][None], state.qdd[None], acceleration_scales(reference, row)[None]
            )


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
