"""Partial impedance in C: what the header declares, and the torques of a motion that is followed exactly."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from linkwise.check.compare import Entries
from linkwise.check.compiled_c import Numbers, Prototype
from linkwise.check.passive_reference import SHARES, passive_reference
from linkwise.check.reference import Reference
from linkwise.package.manifest import Manifest

TARGETS = ("q_d", "qd_d", "qdd_d")
FRAME_TARGETS = ("pose_d", "velocity_d", "acceleration_d")

NOT_CALLED = "frame_partial_impedance"
"""It takes more than arrays: its declaration is held, and that it is there."""
MOST = 8
"""States that the function of the joints is called at."""


def impedance_prototypes(manifest: Manifest, real: str, suffix: str) -> list[Prototype]:
    """These functions of one number type: of free joints, and of frames where links are rigid bodies."""
    tree, kind = manifest.tree, f"{manifest.name}_impedance{suffix}"
    if tree is not None and tree.tied:
        return []
    state = ("q", "qd", *(["p"] if manifest.parameters else []))
    joints = Prototype(
        f"partial_impedance{suffix}",
        real,
        "",
        (*state, "wanted", *TARGETS, "task", "external"),
        ("tau",),
        "int",
        (("wanted", kind),),
    )
    if tree is None:
        return [joints]
    frame = Prototype(
        NOT_CALLED + suffix,
        real,
        "",
        (*state, "posture", *TARGETS, "wanted", *FRAME_TARGETS, "external"),
        ("tau",),
        "int",
        (("posture", kind), ("wanted", f"{manifest.name}_frame_impedance{suffix}")),
    )
    return [joints, frame]


def impedance_calls(
    call: Callable[..., dict[str, Numbers]], function: Prototype, manifest: Manifest, reference: Reference
) -> Iterator[Entries]:
    """Torques of natural impedance on a motion without error: inverse dynamics, and what joints take."""
    states, none = reference.states, dict.fromkeys(("wanted", "q_d", "task", "external"))
    passive = manifest.tree.passive if manifest.tree is not None else ()
    for row in range(0, len(states.q), max(1, len(states.q) // MOST)):
        state = states.at(row)
        given: dict[str, Any] = {"q": state.q, "qd": state.qd, "qd_d": state.qd, "qdd_d": state.qdd, **none}
        found = call(function, 0, given, {"tau": state.q.shape[-1]}, row % 2)["tau"]
        value, scale = (kept["tau"][row].sum(-1) for kept in (reference.values, reference.scales))
        if passive:
            taken, sizes = passive_reference(passive, states.at(np.array([row])))
            friction = SHARES.index("friction")  # which nobody asks to be compensated
            value = value + (taken.sum(0) - taken[friction])[0]
            scale = scale + sizes.sum(0)[0]
        yield Entries("tau", found[None], value[None], scale[None])
