"""Row of the table of calls: what a call is given and what it answers."""

from collections.abc import Mapping
from typing import NamedTuple

ORDER = "order"
"""Name of the axis along which shares by acceleration stand beside those by velocity."""
PACKED = ("c2", "c1", "g", "tau", "h1")
"""Axes of packed values, as `Structure.sizes` counts them."""


class Quantity(NamedTuple):
    """An array in the answer of a call."""

    name: str
    axes: tuple[str, ...]
    """Names of the axes, by which `robot_axes` has a NamedAxis, such as joint; `moved` is the axis of
    whatever an induced acceleration accelerates, `holder` that of links and armatures, which hold energy,
    `mover` that of the coordinates that cause reactions: all, or where ties are kept the independent ones."""
    unit: str
    """Factors of the unit, with divisors after a slash: symbols, or quantity:axis for what is measured along
    an axis."""
    meaning: str
    beside: tuple[str, str] | None = None
    """Name of a further axis, and of this array's entry along it, where several arrays are entries of one."""


class Call(NamedTuple):
    """A row of the table: a call, or one variant of a call."""

    key: str
    """Name of the call and its variant: "mass_matrix_by_link", "kinematics.pose", "constraints.forces"."""
    motion: tuple[str, ...]
    """Names of the arguments of shape (..., n), or (..., m) for those of the independent joints, in order."""
    answers: tuple[Quantity, ...]
    record: type | None = None
    """NamedTuple that holds an answer of several arrays; None for an answer of one."""
    call: str = ""
    """Name of the call, where it is not the key."""
    chosen: Mapping[str, object] = {}
    """Options that select this row among the variants of the call."""
    options: Mapping[str, object] = {}
    """Further options and their defaults."""
    own: str = "not"
    """Treatment of joints' springs, damping, friction and armature: "not", "alone", or "passive" if asked."""
    ties: str = "cut"
    """Treatment of loops and couplings: "cut" as in the open tree, "kept", or "refused" for another call."""
    rigid: bool = False
    """True if the call exists for rigid links alone, and is refused for links given by energies."""
    lacking: tuple[str, ...] = ()
    """Back ends that refuse the call."""
    out: bool = True
    """True if the call has an argument `out`, which says where the answer is written."""
    c: str = ""
    """Name of the C function without the robot's name; empty where the call exists for arrays alone."""
    one: bool = False
    """True if the C function accepts one sample and no count."""

    @property
    def name(self) -> str:
        """Name of the call as an attribute of the robot, such as mass_matrix or kinematics.pose."""
        return self.call or self.key

    @property
    def is_named(self) -> bool:
        """True if the axes of the answer have names; packed values have an axis of indices instead."""
        return not any(axis in PACKED for quantity in self.answers for axis in quantity.axes)
