"""Declarations that a package's header must have of functions of tied joints, and of motions over time.

They take more than arrays, what ties the joints, so that only their declarations and presence are checked
here: the native back end's constraints, which are compared with least squares, call them all, and its
`simulate`, which is compared with the recursion's equations of motion.
"""

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
    "NOT_FINITE": 8,
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
    tied = "constraints", "constraints"
    told = {name: OF_SIMULATION if name == "simulate" else tied for name in TIED}
    return [
        Prototype(
            name + suffix,
            real,
            "count",
            (*motion, *parameters, told[name][0], *behind),
            outputs,
            "int",
            ((told[name][0], f"{manifest.name}_{told[name][1]}{suffix}"),),
        )
        for name, (motion, behind, outputs) in TIED.items()
        if manifest.passive or not name.endswith("_of_links")
    ]
