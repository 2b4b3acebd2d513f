"""Effect of the flags of MJCF's <option> on the torques: every flag that MuJoCo has, in one table.

MuJoCo's XML reference, section option/flag, says what each flag stands for.
"""

from collections.abc import Collection
from typing import Any

from linkwise.errors import LinkwiseError

SWITCHED_OFF: dict[str, tuple[str, ...]] = {
    "CONSTRAINT": ("equality", "friction"),
    "EQUALITY": ("equality",),
    "FRICTIONLOSS": ("friction",),
    "SPRING": ("spring",),
    "DAMPER": ("damping",),
    "GRAVITY": ("gravity", "gravity compensation"),
    # Contacts and limits are not modelled anyway: the torques are those of joints within their limits.
    "CONTACT": (),
    "LIMIT": (),
    "FILTERPARENT": (),
    "MIDPHASE": (),
    "NATIVECCD": (),
    "MULTICCD": (),
    # Torques are what the actuators must give, whether they are on or not; their rotors turn either way.
    "ACTUATION": (),
    "CLAMPCTRL": (),
    "SENSOR": (),
    # How the constraint solver and the integrator go from one time step to the next.
    "WARMSTART": (),
    "REFSAFE": (),
    "EULERDAMP": (),
    "AUTORESET": (),
    "ISLAND": (),
}
"""Forces that each flag of mjtDisableBit switches off, in the words of `mjcf_unmodelled`."""

PASSIVE = ("gravity compensation", "fluid", "plugin")
"""Forces that are switched off too where both springs and dampers are."""

SWITCHED_ON: dict[str, str] = {
    "INVDISCRETE": "differences in place of accelerations",
    # Contacts, constraints, statistics and bookkeeping of a simulation: no part in the torques.
    "OVERRIDE": "",
    "ENERGY": "",
    "FWDINV": "",
    "SLEEP": "",
    "DIAGEXACT": "",
    "IPC": "",
    "SPECULATIVE": "",
    "MULTICCD": "",  # a flag to enable in MuJoCo 3, one to disable since
    "ISLAND": "",
}
"""Effect that each flag of mjtEnableBit adds and that the torques leave out; empty: none."""


def switched_off(mujoco: Any, model: Any) -> frozenset[str]:
    """Return the forces that the file's flags switch off; raises LinkwiseError for an unknown flag."""
    flags = _changed(mujoco.mjtDisableBit, model.opt.disableflags, SWITCHED_OFF)
    off = {what for flag in flags for what in SWITCHED_OFF[flag]}
    return frozenset(off | set(PASSIVE) if {"spring", "damping"} <= off else off)


def switched_on(mujoco: Any, model: Any) -> tuple[str, ...]:
    """Return the effects that the file's flags switch on; raises LinkwiseError for an unknown flag."""
    flags = _changed(mujoco.mjtEnableBit, model.opt.enableflags, SWITCHED_ON)
    return tuple(SWITCHED_ON[flag] for flag in flags if SWITCHED_ON[flag])


def _changed(bits: Any, value: int, known: Collection[str]) -> list[str]:
    """Return the names of the bits set in `value`; raises LinkwiseError for one that is not `known`."""
    flags = [
        name.partition("_")[2]
        for name, bit in bits.__members__.items()
        if "_" in name and int(value) & int(bit)
    ]
    for flag in flags:
        if flag not in known:
            raise LinkwiseError(
                f"<option> changes the flag {flag.lower()!r}, which this version of linkwise does not know; "
                "leave it at its default"
            )
    return flags
