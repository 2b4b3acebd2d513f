"""What a compiled MJCF model says beyond the dynamics of rigid bodies."""

from typing import Any

from linkwise.robot.notes import LEFT_OUT, Note

COUNTS = {
    "actuator": "nu",
    "camera": "ncam",
    "contact pair": "npair",
    "equality": "neq",
    "flex": "nflex",
    "keyframe": "nkey",
    "light": "nlight",
    "mocap": "nmocap",
    "plugin": "nplugin",
    "sensor": "nsensor",
    "site": "nsite",
    "tendon": "ntendon",
}
VALUES = {
    "armature": "dof_armature",
    "damping": "dof_damping",
    "friction": "dof_frictionloss",
    "gravity compensation": "body_gravcomp",
    "limit": "jnt_limited",
    "spring": "jnt_stiffness",
}
"""Arrays that act on a joint or body where they are not zero. Armature is the inertia of a motor's rotor:
unlike the others, it belongs to rigid-body dynamics."""

TENDON_FORCES = ("tendon_stiffness", "tendon_damping", "tendon_frictionloss", "tendon_armature")

FORCES = {
    "actuator",
    "armature",
    "damping",
    "flex",
    "fluid",
    "friction",
    "gravity compensation",
    "plugin",
    "spring",
    "tendon",
}
"""What exerts forces on moving bodies while they touch nothing and stay within their limits."""


def unused(model: Any) -> tuple[Note, ...]:
    """Return a note for each kind of thing that is there, with how often."""
    counts = {what: int(getattr(model, name)) for what, name in COUNTS.items()}
    counts |= {what: sum(value != 0 for value in getattr(model, name)) for what, name in VALUES.items()}
    counts["fluid"] = int(model.opt.density != 0 or model.opt.viscosity != 0)
    acting = FORCES if _pulls(model) else FORCES - {"tendon"}
    return tuple(
        Note("ignored", what, f"{count} ×", LEFT_OUT if what in acting else "")
        for what, count in sorted(counts.items())
        if count
    )


def _pulls(model: Any) -> bool:
    """Whether a tendon exerts a force by itself: one that only bounds or couples does not."""
    return any(value != 0 for name in TENDON_FORCES for value in getattr(model, name))
