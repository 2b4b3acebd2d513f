"""Table of the calls: what each is given and what it answers, in Python, in C and on all pages of the docs.

Axes are listed in the order of the arrays, after those of the samples: i the joint that is loaded, j the link
through which it is loaded, k the coordinate that moves, which here is called the cause.
"""

from collections.abc import Mapping

from .call import ORDER, PACKED, Call, Quantity
from .joint_reactions import Reactions
from .motion_quantities import Counterfactual, TracedMotion
from .quantities import (
    Coefficients,
    ConstrainedMotion,
    Energy,
    GradientPropagation,
    InducedAccelerations,
    NaturalImpedance,
    Packed,
    PassiveTorque,
    Power,
    Propagation,
    Trajectory,
)
from .share_uncertainty import Uncertainty

TORQUE = "torque:joint"
PASSIVE_KINDS = ("spring", "damping", "friction", "armature")
IJK = ("joint", "link", "cause")
SD = "standard deviation of the"
TAU_IJK = "on the joint, through the link, by the motion of the cause"


def _one(name: str, axes: str, unit: str, meaning: str) -> tuple[Quantity]:
    return (Quantity(name, tuple(axes.split()), unit, meaning),)


def _by_order(
    name: str, unit: tuple[str, str], gravity: tuple[str, str], meaning: str, more: str = ""
) -> tuple[Quantity, ...]:
    """Return the quantities of shares by acceleration, by velocity and, without a cause, by gravity.

    unit: those by acceleration and by velocity; gravity: (name, unit); more: names of further axes
    """
    extra, whose = tuple(more.split()), SD if meaning.startswith(SD) else "the"
    return (
        Quantity(name, (*IJK, *extra), unit[0], meaning, (ORDER, "acceleration")),
        Quantity(name, (*IJK, *extra), unit[1], meaning, (ORDER, "velocity")),
        Quantity(
            gravity[0],
            (*IJK[:2], *extra),
            gravity[1],
            f"{whose} share of gravity, or of all that has a name of its own",
        ),
    )


COEFFICIENT_UNITS = "~torque:joint / acceleration:cause", "torque:joint / velocity:cause"
"""Units of c2 and c1; ~ marks units that are written in kg, m and s."""
PROPAGATION = _by_order("propagation", (TORQUE, TORQUE), ("gravity", TORQUE), f"torque {TAU_IJK}")
POWER = _by_order("power_propagation", ("W", "W"), ("power_gravity", "W"), f"power {TAU_IJK}")
COEFFICIENTS = _by_order("coefficient", COEFFICIENT_UNITS, ("gravity", TORQUE), f"coefficient {TAU_IJK}")
PASSIVE = tuple(
    Quantity("passive_torque", ("joint",), TORQUE, "what the joint takes of its own", ("source", kind))
    for kind in PASSIVE_KINDS
)
"""Beginning of what deviations mean."""
DEVIATIONS = (
    *_one("partial_torque_sd", "joint link", TORQUE, f"{SD} torque on the joint, through the link"),
    *_by_order("coefficient_sd", COEFFICIENT_UNITS, ("", ""), f"{SD} coefficient {TAU_IJK}")[:2],
    *_by_order("propagation_sd", (TORQUE, TORQUE), ("gravity_sd", TORQUE), f"{SD} torque {TAU_IJK}"),
    *_one("torque_sd", "joint", TORQUE, f"{SD} joint torque of all links"),
    *(
        Quantity(
            "joint_propagation_sd", ("joint", "cause"), TORQUE, f"{SD} torque of all links", (ORDER, order)
        )
        for order in ("acceleration", "velocity")
    ),
    *_one("joint_gravity_sd", "joint", TORQUE, f"{SD} torque at rest of all links"),
    *_one("power_sd", "joint link", "W", f"{SD} power that the joint sends into the link"),
    *_one("joint_power_sd", "joint", "W", f"{SD} power that the joint sends into all links"),
)
QDD_OF_JOINTS = _one("forward_dynamics", "joint", "acceleration:joint", "joint acceleration")
REQUIRED = object()
"""Value of an option that has to be given."""
BY_LINK: Mapping[str, object] = {"by_link": True}


Q, QD, QDD = ("q",), ("q", "qd"), ("q", "qd", "qdd")


def _by_link(
    name: str, motion: tuple[str, ...], axes: str, unit: str, meaning: str, c: str = ""
) -> tuple[Call, Call]:
    """Return two rows: a sum over the links, and the same quantity by link, as its second axis."""
    first, *rest = axes.split()
    by_link = _one(name, " ".join([first, "link", *rest]), unit, f"{meaning}, by link")
    return (
        Call(name, motion, _one(name, axes, unit, meaning), chosen={"by_link": False}, c=c, one=bool(c)),
        Call(f"{name}_by_link", motion, by_link, call=name, chosen={"by_link": True}),
    )


def _packed(*fields: tuple[str, str]) -> tuple[Quantity, ...]:
    return tuple(
        Quantity(name, (axis,), "", "packed values, as the layout has them") for name, axis in fields
    )


DYNAMICS = (
    Call(
        "packed",
        QDD,
        _packed(*zip(Packed._fields, PACKED, strict=True)),
        Packed,
        c="decomposition",
    ),
    Call("packed_torque", QDD, _packed(("torque", "tau")), c="torque"),
    Call(
        "partial_torque",
        QDD,
        _one("partial_torque", "joint link", TORQUE, "torque on the joint, through the link"),
        c="partial_torque",
    ),
    Call(
        "inverse_dynamics",
        QDD,
        _one("inverse_dynamics", "joint", TORQUE, "joint torque of all links"),
        c="inverse_dynamics",
    ),
    Call("passive_torque", QDD, PASSIVE, PassiveTorque, own="alone"),
    Call("coefficients", QD, COEFFICIENTS, Coefficients, c="coefficients"),
    Call("propagation", QDD, PROPAGATION, Propagation, chosen={"convention": "closing"}, c="propagation"),
    Call(
        "gradient_propagation",
        QDD,
        PROPAGATION,
        GradientPropagation,
        call="propagation",
        chosen={"convention": "gradient"},
        c="gradient_propagation",
    ),
    Call(
        "named_shares",
        QD,
        _one(
            "named_shares", "joint link share", TORQUE, "torque on the joint, through the link, by its name"
        ),
    ),
    Call(
        "position_gradient",
        QDD,
        _one(
            "position_gradient", "joint link cause", "torque:joint / position:cause", f"stiffness {TAU_IJK}"
        ),
        c="dense_position_gradient",
    ),
    Call(
        "masked",
        QDD,
        _one("masked", "joint link", TORQUE, "chosen torques on the joint, through the link"),
        options={"mask": REQUIRED},
    ),
    Call(
        "regressor",
        QDD,
        _one("regressor", "joint link parameter", "~torque:joint / place:parameter", "torque per parameter"),
        rigid=True,
        lacking=("autograd",),
        c="regressor",
    ),
    Call(
        "coefficient_regressors",
        QD,
        _by_order(
            "coefficient_regressor",
            (f"{COEFFICIENT_UNITS[0]} place:parameter", f"~{COEFFICIENT_UNITS[1]} place:parameter"),
            ("gravity_regressor", "~torque:joint / place:parameter"),
            f"coefficient per parameter, {TAU_IJK}",
            "parameter",
        ),
        Coefficients,
        rigid=True,
        lacking=("autograd",),
        c="coefficient_regressors",
    ),
    Call(
        "uncertainty",
        QDD,
        DEVIATIONS,
        Uncertainty,
        options={"bodies": None, "motion": None},
        rigid=True,
        lacking=("autograd",),
        out=False,
    ),
    *_by_link(
        "mass_matrix",
        Q,
        "joint cause",
        COEFFICIENT_UNITS[0],
        "torque per acceleration of the cause",
        "mass_matrix",
    ),
    *_by_link("coriolis_matrix", QD, "joint cause", COEFFICIENT_UNITS[1], "torque per velocity of the cause"),
    *_by_link(
        "gravity_torque", Q, "joint", TORQUE, "torque at rest: of gravity, or of all shares with names"
    ),
    Call(
        "forward_dynamics",
        ("q", "qd", "tau"),
        QDD_OF_JOINTS,
        chosen={"passive": True},
        own="passive",
        ties="refused",
        c="forward_dynamics",
        one=True,
    ),
    Call(
        "forward_dynamics_of_links",
        ("q", "qd", "tau"),
        QDD_OF_JOINTS,
        call="forward_dynamics",
        chosen={"passive": False},
        ties="refused",
        c="forward_dynamics_of_links",
        one=True,
    ),
    Call(
        "energy",
        QD,
        (
            Quantity("kinetic", ("link",), "J", "kinetic energy of the link"),
            Quantity("potential", ("link",), "J", "potential energy of the link"),
        ),
        Energy,
    ),
    Call("power", QDD, POWER, Power),
    *_by_link(
        "christoffel",
        Q,
        "joint cause other_cause",
        "~torque:joint / velocity:cause velocity:other_cause",
        "torque per pair of velocities",
    ),
    Call(
        "natural_impedance",
        QDD,
        (
            Quantity("inertia", IJK, COEFFICIENT_UNITS[0], "torque per acceleration of the cause"),
            Quantity("damping", IJK, COEFFICIENT_UNITS[1], "torque per velocity of the cause"),
            Quantity("stiffness", IJK, "torque:joint / position:cause", "torque per position of the cause"),
        ),
        NaturalImpedance,
    ),
)
"""Calls of `Dynamics` whose answers have a fixed shape for each sample."""

SOURCES = (
    ("actuators", "cause", "by what the actuator of the cause gives"),
    ("velocity", "link cause", "by velocity forces on the link, by the velocity of the cause"),
    ("gravity", "link", "by the weight of the link, or all of its shares with names"),
    ("passive", "source cause", "by spring, damping and friction of the cause"),
    ("loads", "load", "by the load"),
    ("constraints", "cause", "by constraints that turn with the velocity of the cause"),
    ("kinematic", "cause", "by the velocity of the cause, without any acceleration of a joint"),
)


def _induced(unit: str, what: str, first: str = "moved") -> tuple[Quantity, ...]:
    return tuple(Quantity(n, (first, *a.split()), unit, f"{what} {meaning}") for n, a, meaning in SOURCES)


WRENCH = "torque:wrench"
BORNE = (
    ("acceleration", "tree_joint link mover wrench", "through the link, by the acceleration of the mover"),
    ("velocity", "tree_joint link mover wrench", "through the link, by the velocity of the mover"),
    ("gravity", "tree_joint link wrench", "by the weight of the link"),
    ("loads", "tree_joint load wrench", "by the load"),
    ("passive", "tree_joint kind joint wrench", "by what ties do not carry of the joint's own torque"),
)

DRIVEN = {"tau": None, "qdd": None, "loads": (), "passive": True}
"""Options that say what drives a motion, for the calls on its causes, and their defaults."""
MOTIONS = (
    Call(
        "induced_accelerations",
        QD,
        _induced("acceleration:moved", "acceleration"),
        InducedAccelerations,
        options=DRIVEN | {"frame": None, "point": None, "constraints": None},
        own="passive",
        ties="kept",
        out=False,
    ),
    Call(
        "induced_reactions",
        QD,
        _induced("torque:moved", "force of the constraint"),
        InducedAccelerations,
        options=DRIVEN | {"constraints": None},
        own="passive",
        ties="kept",
        out=False,
    ),
    Call(
        "reactions",
        QDD,
        tuple(Quantity(name, tuple(axes.split()), WRENCH, f"wrench {by}") for name, axes, by in BORNE),
        Reactions,
        options={
            "axes": "joint",
            "point": None,
            "joints": None,
            "loads": (),
            "passive": True,
            "constraints": None,
        },
        own="passive",
        ties="kept",
        rigid=True,
        lacking=("autograd",),
        out=False,
    ),
    Call(
        "induced_power",
        QD,
        _induced("W", "power into the link or armature", "holder"),
        InducedAccelerations,
        options=DRIVEN | {"constraints": None},
        own="passive",
        ties="kept",
        out=False,
    ),
    Call(
        "induced_flow",
        QD,
        _induced("W", "power through the joint", "joint"),
        InducedAccelerations,
        options=DRIVEN | {"constraints": None, "side": "successor"},
        own="passive",
        ties="kept",
        rigid=True,
        out=False,
    ),
    Call(
        "simulate",
        QD,
        (
            Quantity("time", (), "s", "time"),
            Quantity("q", ("joint",), "position:joint", "joint position"),
            Quantity("qd", ("joint",), "velocity:joint", "joint velocity"),
            Quantity("tau", ("joint",), TORQUE, "what the actuators gave"),
            Quantity("energy", (), "J", "energy of links, springs and armature"),
            Quantity("work", (), "J", "work of actuators and loads, less what was lost"),
        ),
        Trajectory,
        options={
            "time": REQUIRED,
            "tau": None,
            "loads": (),
            "passive": True,
            "step": None,
            "method": "RK4",
            "rtol": 1e-9,
            "atol": 1e-12,
            "constraints": None,
            "inputs": None,
        },
        own="passive",
        ties="kept",
        out=False,
    ),
    Call(
        "trace",
        QDD,
        (
            Quantity("time", (), "s", "time"),
            Quantity("velocity", ("joint", "origin", "window"), "velocity:joint", "velocity from the source"),
            Quantity("energy", ("origin", "window"), "J", "energy of the velocity from the source"),
            Quantity("power", ("origin", "window"), "W", "rate of that energy"),
            Quantity("work", ("origin", "window"), "J", "integral of that power"),
        ),
        TracedMotion,
        options={
            "time": REQUIRED,
            "tau": None,
            "loads": (),
            "passive": True,
            "constraints": None,
            "windows": (),
            "restarts": (),
            "by_link": False,
            "weight": "apart",
        },
        own="passive",
        ties="kept",
        out=False,
    ),
    Call(
        "counterfactual",
        QDD,
        (
            Quantity("time", (), "s", "time"),
            Quantity("q", ("joint",), "position:joint", "joint position without the source"),
            Quantity("qd", ("joint",), "velocity:joint", "joint velocity without the source"),
            Quantity("first_order_q", ("joint",), "position:joint", "the position to first order"),
            Quantity("first_order_qd", ("joint",), "velocity:joint", "the velocity to first order"),
            Quantity("drift", ("joint",), "position:joint", "error of a simulation with the source"),
        ),
        Counterfactual,
        options={
            "time": REQUIRED,
            "without": REQUIRED,
            "tau": None,
            "loads": (),
            "passive": True,
            "constraints": None,
            "step": None,
        },
        own="passive",
        ties="kept",
        out=False,
    ),
)
"""Calls of `Dynamics` on motion, whose axes depend on the arguments."""

OF_FRAME: Mapping[str, object] = {"frame": REQUIRED}
OF_POINT: Mapping[str, object] = {"frame": REQUIRED, "point": None}


def _frame(
    name: str,
    motion: tuple[str, ...],
    axes: str,
    unit: str,
    meaning: str,
    options: Mapping[str, object] = {},
    c: str = "",
) -> Call:
    answers = _one(name, axes, unit, meaning)
    return Call(f"kinematics.{name}", motion, answers, options=options, rigid=True, c=c, one=bool(c))


PLACED = "of a place in the frame to one in the world"
RATE_OF_COMPONENT = "velocity:component / position:cause"
KINEMATICS = (
    _frame("pose", Q, "world own", "place:world / place:own", PLACED, OF_FRAME, "pose"),
    _frame("poses", Q, "frame world own", "place:world / place:own", PLACED),
    _frame(
        "jacobian",
        Q,
        "component cause",
        "position:component / position:cause",
        "motion of the frame per motion of the cause",
        OF_POINT,
        "jacobian",
    ),
    _frame("jacobian_rate", QD, "component cause", RATE_OF_COMPONENT, "its rate", OF_POINT, "jacobian_rate"),
    _frame("velocity", QD, "component", "velocity:component", "velocity of the frame", OF_POINT),
    _frame("acceleration", QDD, "component", "acceleration:component", "acceleration of the frame", OF_POINT),
    _frame(
        "load_torque",
        Q,
        "joint",
        TORQUE,
        "what the joint takes to bear the load",
        {"frame": REQUIRED, "force": REQUIRED, "moment": None, "point": None, "at": None},
    ),
    _frame("centre_of_mass", Q, "axis", "position:axis", "centre of mass in the world"),
    _frame("centre_of_mass_jacobian", Q, "axis cause", "position:axis / position:cause", "its Jacobian"),
    _frame(
        "centre_of_mass_jacobian_rate", QD, "axis cause", "velocity:axis / position:cause", "rate of that"
    ),
)
"""Calls of `Kinematics`; the axis of frames is as long as the robot has frames."""


TIED_IN_C = {
    "violation": "constraint_rows",
    "jacobian": "constraint_rows",
    "jacobian_rate": "constraint_rows",
    "closed": "closed",
    "velocity_map": "following",
    "velocity_accelerations": "following",
    "partial_torque": "constrained_torque",
    "coefficients": "constrained_coefficients",
    "propagation": "constrained_propagation",
    "forces": "constrained_torque",
    "force_coefficients": "constrained_coefficients",
    "force_propagation": "constrained_propagation",
    "forward_dynamics": "constrained_dynamics",
}
"""Functions of C for calls of `Constraints`, of rigid links; some answer several."""


def _driven(quantity: Quantity) -> Quantity:
    """Return a quantity of all joints as one of the joints that constraints leave independent."""
    named = {"joint": "independent", "cause": "independent_cause"}
    unit = quantity.unit.replace("joint", "independent").replace("cause", "independent_cause")
    return quantity._replace(axes=tuple(named.get(axis, axis) for axis in quantity.axes), unit=unit)


def _borne(quantity: Quantity) -> Quantity:
    """Return a quantity of joints' torques as one of what the rows of constraints bear."""
    named = {"joint": "constraint", "cause": "independent_cause"}
    unit = quantity.unit.replace("joint", "constraint").replace("cause", "independent_cause").lstrip("~")
    by = "by the motion of the cause" if "cause" in quantity.axes else "at rest"
    return quantity._replace(
        name=f"force_{quantity.name}",
        axes=tuple(named.get(axis, axis) for axis in quantity.axes),
        unit=unit,
        meaning=f"what the row bears of the link, {by}",
    )


def _tied(
    name: str,
    motion: tuple[str, ...],
    axes: str,
    unit: str,
    meaning: str,
    options: Mapping[str, object] = {},
    call: str = "",
    chosen: Mapping[str, object] = {},
) -> Call:
    return _kept(name, motion, _one(name, axes, unit, meaning), None, call, chosen, options)


def _kept(
    name: str,
    motion: tuple[str, ...],
    answers: tuple[Quantity, ...],
    record: type | None,
    call: str = "",
    chosen: Mapping[str, object] = {},
    options: Mapping[str, object] = {},
    own: str = "not",
) -> Call:
    named = f"constraints.{call}" if call else ""
    return Call(
        f"constraints.{name}",
        motion,
        answers,
        record,
        named,
        chosen,
        options,
        own,
        ties="kept",
        out=False,
        c=TIED_IN_C.get(name, ""),
    )


FORCE = "torque:constraint"
TORQUES = {"torque": REQUIRED}
SUMMED: Mapping[str, object] = {"by_link": False}
CONSTRAINTS = (
    _tied(
        "violation",
        Q,
        "constraint",
        "position:constraint",
        "how far the row is from closing",
        {"held_at": None},
    ),
    _tied(
        "jacobian",
        Q,
        "constraint cause",
        "position:constraint / position:cause",
        "row per motion of the cause",
    ),
    _tied("jacobian_rate", QD, "constraint cause", "velocity:constraint / position:cause", "its rate"),
    _tied(
        "closed",
        Q,
        "joint",
        "position:joint",
        "joint position in which all ties close",
        {"held_at": None, "start": None},
    ),
    _tied(
        "velocity_map",
        Q,
        "joint independent_cause",
        "position:joint / position:independent_cause",
        "motion of the joint per motion of the cause",
    ),
    _tied("velocity", ("q", "yd"), "joint", "velocity:joint", "joint velocity"),
    _tied("acceleration", ("q", "qd", "ydd"), "joint", "acceleration:joint", "joint acceleration"),
    _tied("velocity_accelerations", QD, "joint cause", "acceleration:joint", "by the velocity of the cause"),
    _tied(
        "projected",
        Q,
        "independent",
        "torque:independent",
        "torque on the independent joint",
        TORQUES,
        chosen=SUMMED,
    ),
    _tied(
        "projected_by_link",
        Q,
        "independent part",
        "torque:independent",
        "torque on the independent joint",
        TORQUES,
        "projected",
        BY_LINK,
    ),
    *(
        _kept(row.key, row.motion, tuple(map(_driven, row.answers)), row.record)
        for row in DYNAMICS
        if row.key in ("inverse_dynamics", "partial_torque", "coefficients", "propagation")
    ),
    _tied("forces", QDD, "constraint link", FORCE, "what the row bears of the link"),
    *(
        _kept(f"force_{row.key}", row.motion, tuple(map(_borne, row.answers)), row.record)
        for row in DYNAMICS
        if row.key in ("coefficients", "propagation")
    ),
    _tied("forces_of", Q, "constraint", FORCE, "what the row bears", TORQUES, chosen=SUMMED),
    _tied(
        "forces_of_by_link", Q, "constraint part", FORCE, "what the row bears", TORQUES, "forces_of", BY_LINK
    ),
    _kept(
        "forward_dynamics",
        ("q", "qd", "tau"),
        (
            Quantity("qdd", ("joint",), "acceleration:joint", "joint acceleration"),
            Quantity("forces", ("constraint",), FORCE, "what the row bears"),
        ),
        ConstrainedMotion,
        options={"passive": True},
        own="passive",
    ),
)
"""Calls of `Constraints`."""

CALLS: Mapping[str, Call] = {row.key: row for row in (*DYNAMICS, *MOTIONS, *KINEMATICS, *CONSTRAINTS)}
"""Rows of all calls by their keys."""
