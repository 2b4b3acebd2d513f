"""Declarations that a package's header must have of functions of tied joints, and of motions over time.

They take more than arrays, what ties the joints, so that only their declarations and presence are checked
here: the native back end's constraints, which are compared with least squares, call them all, and its
`simulate`, which is compared with the recursion's equations of motion.
"""

from collections.abc import Mapping

from linkwise_runtime.native.library import MOST_TIED, scratch_numbers

from linkwise.check.compiled_c import Prototype
from linkwise.package.manifest import Manifest

PARTS = ("acceleration", "velocity", "gravity", "force_acceleration", "force_velocity", "force_gravity")
RESPONSES = ("velocity", "response", "reactions", "accelerations", "forces")
TIED: dict[str, tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]] = {
    "constraint_rows": (("q", "qd"), ("held_at",), ("violation", "jacobian", "rate")),
    "closed": (("q",), ("held_at",), ("closed",)),
    "following": (("q", "qd"), (), ("map", "velocity", "accelerations")),
    "constrained_coefficients": (("q", "qd"), (), PARTS),
    "constrained_propagation": (("q", "qd", "qdd"), (), PARTS),
    "constrained_torque": (("q", "qd", "qdd"), (), ("torque", "forces")),
    "constrained_response": (("q", "qd"), (), RESPONSES),
    "constrained_response_of_links": (("q", "qd"), (), RESPONSES),
    "constrained_dynamics": (("q", "qd", "tau"), (), ("qdd", "forces")),
    "constrained_dynamics_of_links": (("q", "qd", "tau"), (), ("qdd", "forces")),
    "simulate": (("q", "qd"), (), ("scratch", "positions", "velocities", "torques", "work")),
}
"""Functions of tied joints: their motion, what they take behind the constraints, and what they write."""
CONTROLLERS: dict[str, tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]] = {
    "constrained_partial_impedance": (
        ("q", "qd"),
        ("q_d", "qd_d", "qdd_d", "task", "external"),
        ("tau", "qdd", "forces"),
    ),
    "constrained_frame_partial_impedance": (
        ("q", "qd"),
        ("q_d", "qd_d", "qdd_d", "wanted", "pose_d", "velocity_d", "acceleration_d", "external"),
        ("tau", "qdd", "forces"),
    ),
    "constrained_cancel": (("q", "qd", "qdd"), ("task",), ("tau",)),
}
"""Controllers of tied joints, for one sample, likewise; what they take behind what is CONTROLLED."""
CONTROLLED = ("constraints", "actuators")
OF_FRAME = {"posture": "impedance", "wanted": "frame_impedance"}
"""Structs of the controller of a frame beside these."""
KEEP = "contacts_keep"
"""Function that says whether contacts keep."""
OF_TIES = (*TIED, *CONTROLLERS, KEEP)
"""All functions of tied joints."""
STRUCTS = {"constraints": "constraints", "actuators": "actuators", "wanted": "impedance", "grip": "grip"}
"""Arguments that are structs, and whose names these have."""
OF_SIMULATION = "wanted", "simulation"
"""Argument in which a simulation has its constraints, and its type, without the robot's name."""
CONSTANTS = {
    "CONTACT_POINT": 0,
    "CONTACT_HINGED": 1,
    "CONTACT_HELD": 2,
    "CONTACT_ROLLING": 4,
    "MOST_CONTACTS": 8,
    "STEPS": 50,
    "TIES_OPEN": 1,
    "TIES_SINGULAR": 2,
    "TIES_CONTRADICT": 3,
    "TIES_UNCLOSED": 4,
    "NO_INERTIA": 5,
    "UNKNOWN": 6,
    "TIES_LOST": 7,
    "NOT_POSITIVE": 8,
    "UNDRIVEN": 9,
    "NOT_FINITE": 10,
    "STUCK": 11,
    "HALF_A_TURN": 12,
}
"""Constants of the header, without the robot's name."""


def tied_constants(manifest: Manifest) -> dict[str, int]:
    """Return the constants of these functions; none for links of energies."""
    tree, n = manifest.tree, len(manifest.joints)
    if tree is None or n > MOST_TIED:
        return {} if tree is None else CONSTANTS
    kinds = (tie.kind for tie in tree.ties)
    return CONSTANTS | {"SCRATCH": scratch_numbers(n, kinds, len(tree.couplings))}


def tied_prototypes(manifest: Manifest, real: str, suffix: str) -> list[Prototype]:
    """Return the functions of one number type; none for links of energies, and for very many joints."""
    if manifest.tree is None or len(manifest.joints) > MOST_TIED:
        return []
    parameters = ("p",) if manifest.parameters else ()

    def declared(
        name: str,
        counted: str,
        inputs: tuple[str, ...],
        outputs: tuple[str, ...],
        structs: Mapping[str, str] = STRUCTS,
    ) -> Prototype:
        kinds = tuple((of, f"{manifest.name}_{kind}{suffix}") for of, kind in structs.items())
        return Prototype(name + suffix, real, counted, inputs, outputs, "int", kinds)

    def of_samples(name: str) -> Prototype:
        motion, behind, outputs = TIED[name]
        of, kind = OF_SIMULATION if name == "simulate" else ("constraints", "constraints")
        return declared(name, "count", (*motion, *parameters, of, *behind), outputs, {of: kind})

    def controller(name: str) -> Prototype:
        motion, behind, outputs = CONTROLLERS[name]
        first, structs = ("posture", STRUCTS | OF_FRAME) if "frame" in name else ("wanted", STRUCTS)
        return declared(name, "", (*motion, *parameters, *CONTROLLED, first, *behind), outputs, structs)

    return [
        *(of_samples(name) for name in TIED if manifest.passive or not name.endswith("_of_links")),
        *(controller(name) for name in CONTROLLERS),
        declared(KEEP, "grips", ("constraints", "grip", "forces"), ()),
    ]
