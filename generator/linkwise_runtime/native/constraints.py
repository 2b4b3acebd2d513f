"""C functions of joints that loops, couplings and contacts tie, for one sample and for many."""

import ctypes
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple, cast

import numpy as np
from numpy.typing import NDArray

from ..constraints.chosen_constraints import TreeConstraints
from ..constraints.held_frames import Held
from ..control.frame_impedance import FrameTargets
from ..control.joint_impedance import JointTargets
from ..interface import Numbers
from .calls import NativeCalls, plain
from .control import RealType
from .library import MOST_CONTACTS, MOST_TIED, OneSampleCall, OneSamplePool, one_sample_call, symbol
from .memory import NumberArray, NumberType, address, memory
from .tied_control import TiedStance, TiedTorque

if TYPE_CHECKING:
    from ctypes import _NamedFuncPointer as CFunction

KINDS = {"point": 0, "hinge": 1, "frame": 2, "rolling": 4}
"""Numbers of the kinds of contacts in C."""


class TiedCall(NamedTuple):
    """An answer of a C function of tied joints."""

    function: str
    motion: int
    """Number of arrays of motion that are given; where the function takes more, they are NULL."""
    outputs: tuple[str, ...]
    """Shape of each output, by the letters of `sizes`; empty for one that is not wanted."""
    takes: int = 2
    """Number of arrays of motion that the function takes."""
    held: bool = False
    """True if the function takes positions in which contacts took hold."""


PARTS = ("mNm", "mNm", "mN")
FORCES = ("CNm", "CNm", "CN")
RESPONSES = ("n", "nn", "Cn", "nn", "Cn")
CALLS = {
    "violation": TiedCall("constraint_rows", 1, ("C", "", ""), held=True),
    "positions": TiedCall("constraint_rows", 1, ("C", "Cn", ""), held=True),
    "jacobian": TiedCall("constraint_rows", 1, ("", "Cn", ""), held=True),
    "jacobian_rate": TiedCall("constraint_rows", 2, ("", "", "Cn"), held=True),
    "closed": TiedCall("closed", 1, ("n",), takes=1, held=True),
    "velocity_map": TiedCall("following", 1, ("nm", "", "")),
    "velocity_accelerations": TiedCall("following", 2, ("", "", "nn")),
    "following": TiedCall("following", 2, ("nm", "", "nn")),
    "coefficients": TiedCall("constrained_coefficients", 2, (*PARTS, "", "", "")),
    "propagation": TiedCall("constrained_propagation", 3, (*PARTS, "", "", ""), takes=3),
    "force_coefficients": TiedCall("constrained_coefficients", 2, ("", "", "", *FORCES)),
    "force_propagation": TiedCall("constrained_propagation", 3, ("", "", "", *FORCES), takes=3),
    "shares_and_forces": TiedCall("constrained_coefficients", 2, (*PARTS, *FORCES)),
    "partial_torque": TiedCall("constrained_torque", 3, ("mN", ""), takes=3),
    "forces": TiedCall("constrained_torque", 3, ("", "CN"), takes=3),
    "response": TiedCall("constrained_response", 2, RESPONSES),
    "response_of_links": TiedCall("constrained_response_of_links", 2, RESPONSES),
    "forward_dynamics": TiedCall("constrained_dynamics", 3, ("n", "C"), takes=3),
    "forward_dynamics_of_links": TiedCall("constrained_dynamics_of_links", 3, ("n", "C"), takes=3),
}
"""Answers by name."""


def contact_struct(real: RealType) -> type[ctypes.Structure]:
    """Return the struct NAME_contact of double or float."""
    fields: list[tuple[str, Any]] = [("kind", ctypes.c_int), ("frame", ctypes.c_int)]
    fields += [(name, real * 3) for name in ("point", "axis", "arm")]
    return type("ContactStruct", (ctypes.Structure,), {"_fields_": fields})


def constraints_struct(real: RealType) -> type[ctypes.Structure]:
    """Return the struct NAME_constraints of double or float."""
    fields: list[tuple[str, Any]] = [
        ("contacts", ctypes.c_int),
        ("contact", ctypes.c_void_p),
        ("freedoms", ctypes.c_int),
        ("independent", ctypes.c_void_p),
        ("tolerance", real),
        ("weight", ctypes.c_void_p),
    ]
    return type("ConstraintsStruct", (ctypes.Structure,), {"_fields_": fields})


@dataclass(frozen=True)
class TiedSettings:
    """Constraints as C is told of them, in one number type, and the memory that this points to."""

    struct: ctypes.Structure
    kept: tuple[object, ...]


def told(
    contacts: Sequence[Held],
    independent: Sequence[int],
    tolerance: float | None,
    weight: NDArray[np.float64] | None,
    kind: NumberType,
) -> TiedSettings:
    """Return constraints as C takes them."""
    real = ctypes.c_double if kind.itemsize == 8 else ctypes.c_float
    one = contact_struct(real)
    listed = (one * max(len(contacts), 1))()
    for made, held in zip(listed, contacts, strict=False):
        made.kind, made.frame = KINDS[held.kind], held.first
        made.point, made.axis, made.arm = (
            (real * 3)(*a) for a in (held.point, held.axes[:, 2].tolist(), held.arm)
        )
    joints: NDArray[np.intc] = np.array(independent, np.intc)
    # 0 asks C for the tolerances that None stands for; a tolerance of 0 is as small as numbers go.
    allowed = 0.0 if tolerance is None else max(tolerance, float(np.finfo(kind).tiny))
    struct = constraints_struct(real)(
        len(contacts), ctypes.addressof(listed), len(joints), address(joints), allowed, None
    )
    shares = None if weight is None else weight.astype(kind)
    if shares is not None:
        struct.weight = address(shares)
    return TiedSettings(struct, (listed, joints, shares))


class NativeTies:
    """Answers of C for constraints and their independent joints; see `TiedFunctions`."""

    def __init__(self, calls: NativeCalls, chosen: TreeConstraints, tolerance: float | None) -> None:
        self._calls, structure = calls, calls.structure
        self._contacts = [one for one in chosen.held if one.second is None]
        self._independent, self._chosen = chosen.independent, (tolerance, chosen.force_weight)
        self._sizes = {
            "n": structure.n,
            "N": structure.N,
            "m": len(chosen.independent),
            "C": len(chosen.rows),
        }
        self._told: dict[NumberType, TiedSettings] = {}
        self._functions: dict[tuple[str, NumberType], CFunction] = {}
        self._of_one, self._shape = OneSamplePool(self._one_sample), (structure.n,)
        self._passive = bool(structure.passive)

    def at_once(self, call: str, motion: Sequence[object]) -> Sequence[NumberArray] | None:
        """Return the answer for one plain sample of a call made before; None for anything else."""
        kind, shape = getattr(motion[0], "dtype", None), self._shape
        if len(motion) != CALLS[call].motion:  # which the call itself refuses
            return None
        for a in motion:
            if type(a) is not np.ndarray or a.dtype is not kind or a.shape != shape:
                return None
        key: Any = call, kind, False
        if key not in self._of_one.free:
            return None
        arrays: Any = motion
        try:
            numbers = b"".join(arrays)
        except TypeError:  # one of the arrays is not contiguous
            return None
        return self._of_one.results(key, numbers) or None

    def answer(
        self, call: str, motion: Sequence[Numbers], held_at: Numbers | None = None
    ) -> Sequence[NumberArray] | None:
        """Return the answer for arrays (..., n) of one shape; None where C has none."""
        if len(motion) != CALLS[self._name(call)].motion:
            return None
        arrays = [*motion] if held_at is None else [*motion, held_at]
        given = [a for a in arrays if isinstance(a, np.ndarray)]
        if len(given) < len(arrays):
            return None
        batch, name, q = given[0].shape[:-1], self._name(call), given[0]
        if q.size == q.shape[-1]:
            key = call, q.dtype, held_at is not None
            found: Sequence[NumberArray] = self._of_one.results(key, b"".join(a.tobytes() for a in given))
        else:
            found = self._of_many(name, given, held_at is not None)
        shapes = [self._shape_of(letters) for letters in CALLS[name].outputs if letters]
        return [a.reshape(*batch, *shape) for a, shape in zip(found, shapes, strict=True)] if found else None

    def controller(
        self,
        targets: object,
        frame: object,
        driven: Sequence[int],
        weight: NDArray[np.float64],
        undriven: int,
    ) -> TiedTorque:
        """Return the object by which C computes a controller's torque for one sample."""
        rows = self._sizes["C"]
        stance = TiedStance(lambda kind: self.settings(kind).struct, rows, driven, weight, undriven)
        aimed = cast("FrameTargets | None", frame)
        return TiedTorque(self._calls, cast(JointTargets, targets), aimed, stance)

    def settings(self, kind: NumberType) -> TiedSettings:
        """Return the constraints as C takes them in one number type, made once."""
        if kind not in self._told:
            self._told[kind] = told(self._contacts, self._independent, *self._chosen, kind)
        return self._told[kind]

    def _function(self, name: str, kind: NumberType) -> "CFunction":
        """Return a C function for a dtype, compiled if it is not there yet."""
        if (name, kind) not in self._functions:
            found = self._functions[name, kind] = symbol(self._calls.sources, name, kind.str[1:])
            found.restype = ctypes.c_int
        return self._functions[name, kind]

    def _name(self, call: str) -> str:
        """Return the call that is made for this one, where joints have nothing of their own."""
        return call if self._passive else call.removesuffix("_of_links")

    def _of_many(self, name: str, given: Sequence[NumberArray], held: bool) -> Sequence[NumberArray]:
        """Return the results for a batch; none where the function failed."""
        kind, count = given[0].dtype, given[0].size // self._sizes["n"]
        asked = CALLS[name]
        results = [memory((count, *self._shape_of(x)), kind) if x else None for x in asked.outputs]
        read = [plain(a) for a in given]
        function = self._function(asked.function, kind)
        arguments = self._arguments(asked, count, kind, read, results, held)
        pointers = [
            ctypes.c_void_p(address(a)) if isinstance(a, np.ndarray) else a
            for a in arguments
            if not isinstance(a, np.ndarray) or a.size or a is not self._calls.constants(kind)
        ]
        failed = count and function(*pointers)
        return [] if failed else [a for a in results if a is not None]

    def _one_sample(self, key: tuple[str, NumberType, bool]) -> OneSampleCall:
        """Return a call, in whose memory positions in which contacts took hold stand behind the motion."""
        call, kind, held = key
        asked, n = CALLS[self._name(call)], self._sizes["n"]
        motion = np.empty((asked.motion + held, n), kind)
        results = [np.empty(self._shape_of(x), kind) if x else None for x in asked.outputs]
        found = self._function(asked.function, kind)
        given = self._arguments(asked, 1, kind, [*motion], results, held)
        made = one_sample_call(found, True, given, motion, [])
        return made._replace(results=[a for a in results if a is not None])

    def _arguments(
        self,
        asked: TiedCall,
        count: int,
        kind: NumberType,
        given: Sequence[NumberArray],
        results: Sequence[NumberArray | None],
        held: bool,
    ) -> list[object]:
        """Return the arguments in the order of C; the constants are empty without parameters."""
        missing = [None] * (asked.takes - asked.motion)
        last = [given[-1] if held else None] if asked.held else []
        return [
            ctypes.c_size_t(count),
            *given[: asked.motion],
            *missing,
            self._calls.constants(kind),
            ctypes.byref(self.settings(kind).struct),
            *last,
            *results,
        ]

    def _shape_of(self, letters: str) -> tuple[int, ...]:
        return tuple(self._sizes[letter] for letter in letters)


def has_functions(calls: NativeCalls, chosen: object) -> bool:
    """Return whether C has functions for constraints: of rigid links, with numbers that stay as they are."""
    if calls.structure.n > MOST_TIED or calls.learned or not isinstance(chosen, TreeConstraints):
        return False
    contacts = sum(one.second is None for one in chosen.held)
    return contacts <= MOST_CONTACTS and math.prod((len(chosen.rows), len(chosen.independent))) > 0
