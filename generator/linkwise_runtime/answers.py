"""The calls of `Dynamics` behind its face: motion is checked, answers computed and put where `out` says."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np

from .arguments import check_numbers
from .composed import Composed
from .interface import Backend
from .outputs import accepted
from .passive_joints import passive_torques
from .quantities import (
    Coefficients,
    Energy,
    GradientPropagation,
    Packed,
    PassiveTorque,
    Power,
    Propagation,
)
from .quantity_axes import ARRAYS
from .robot_axes import axes_of
from .structure import Structure

KINDS: dict[str, Any] = {
    "packed": Packed,
    "coefficients": Coefficients,
    "propagation": Propagation,
    "gradient_propagation": GradientPropagation,
    "coefficient_regressors": Coefficients,
    "energy": Energy,
    "power": Power,
    "passive_torque": PassiveTorque,
}
"""What calls with several results answer with; the others answer with one array or tensor."""

MOTION = ("q", "qd", "qdd")
"""What the calls are given, the last only where it is asked for."""

Shapes = tuple[tuple[int, ...], ...]


def answer_shapes(structure: Structure) -> dict[str, Shapes]:
    """Shapes of each call's results for one sample."""
    axes, sizes = axes_of(structure.joint_names, structure.joint_units, structure.link_names), structure.sizes
    return {
        "packed": tuple((size,) for size in sizes),
        "packed_torque": ((sizes.tau,),),
        "packed_position_gradient": ((sizes.c1,),),
    } | {
        call: tuple(tuple(len(axes[axis].names) for axis in quantity.axes) for quantity in quantities)
        for call, quantities in ARRAYS.items()
    }


class Answers:
    """The calls of a back end whose packed values answers are composed of; arguments as `Dynamics` says."""

    contiguous: ClassVar = False
    """Whether what `out` says must be contiguous."""

    def __init__(
        self, structure: Structure, backend: Backend[Any], check_finite: bool, composed: Any = None
    ) -> None:
        """`composed` computes; the closed forms' packed values, composed, unless given."""
        self._structure, self._backend, self._check_finite = structure, backend, check_finite
        self._composed = composed or Composed(structure, backend)
        self._shapes = answer_shapes(structure)

    @property
    def direct(self) -> Mapping[str, Callable[..., Any]]:
        """Calls by name that are quicker than these, given first an object whose class has all calls."""
        return {}

    def read_beside_motion(self) -> Iterable[Any]:
        """Arrays or tensors that results hang on, beside the motion."""
        values: Iterable[Any] = self._backend.parameters.values()
        return values

    def packed(self, q: Any, qd: Any, qdd: Any, out: Any = None) -> Any:
        """See `Dynamics.packed`."""
        return self._answer("packed", (q, qd, qdd), out)

    def packed_torque(self, q: Any, qd: Any, qdd: Any, out: Any = None) -> Any:
        """See `Dynamics.packed_torque`."""
        return self._answer("packed_torque", (q, qd, qdd), out)

    def partial_torque(self, q: Any, qd: Any, qdd: Any, out: Any = None) -> Any:
        """See `Dynamics.partial_torque`."""
        return self._answer("partial_torque", (q, qd, qdd), out)

    def inverse_dynamics(self, q: Any, qd: Any, qdd: Any, out: Any = None) -> Any:
        """See `Dynamics.inverse_dynamics`."""
        return self._answer("inverse_dynamics", (q, qd, qdd), out)

    def coefficients(self, q: Any, qd: Any, out: Any = None) -> Any:
        """See `Dynamics.coefficients`."""
        return self._answer("coefficients", (q, qd), out)

    def propagation(self, q: Any, qd: Any, qdd: Any, convention: str, out: Any = None) -> Any:
        """See `Dynamics.propagation`."""
        if convention not in ("closing", "gradient"):
            raise ValueError(f"no convention {convention!r}; choose closing or gradient")
        call = "propagation" if convention == "closing" else "gradient_propagation"
        return self._answer(call, (q, qd, qdd), out)

    def position_gradient(self, q: Any, qd: Any, qdd: Any, out: Any = None) -> Any:
        """See `Dynamics.position_gradient`."""
        return self._answer("position_gradient", (q, qd, qdd), out)

    def regressor(self, q: Any, qd: Any, qdd: Any, out: Any = None) -> Any:
        """See `Dynamics.regressor`."""
        self._check_rigid()
        return self._answer("regressor", (q, qd, qdd), out)

    def coefficient_regressors(self, q: Any, qd: Any, out: Any = None) -> Any:
        """See `Dynamics.coefficient_regressors`."""
        self._check_rigid()
        return self._answer("coefficient_regressors", (q, qd), out)

    def masked(self, q: Any, qd: Any, qdd: Any, mask: Any, out: Any = None) -> Any:
        """See `Dynamics.masked`."""
        n, motion = self._structure.n, self._motion((q, qd, qdd))
        into = self._accepted("masked", motion, out)
        q, qd, qdd = motion
        weights = self._backend.weights("the mask", mask, q)
        if tuple(weights.shape) != (3, n):
            raise ValueError(
                f"the mask has shape {tuple(weights.shape)}; it must be (3, {n}): order, coordinate"
            )
        acceleration, velocity, _ = self._computed("coefficients", [q, qd])
        total = velocity @ (weights[1] * qd)[..., None, :, None]
        total = total + acceleration @ (weights[2] * qdd)[..., None, :, None]
        # A tensor of numbers that nobody may look at yet, as under vmap, might ask for positions too.
        if not isinstance(weights, np.ndarray) or weights[0].any():
            (stiffness,) = self._computed("position_gradient", motion)
            total = total + stiffness @ (weights[0] * q)[..., None, :, None]
        torque = total[..., 0]
        if into is None:
            return torque
        into[0][...] = torque
        return out

    def passive_torque(self, q: Any, qd: Any, qdd: Any, out: Any = None) -> Any:
        """See `Dynamics.passive_torque`."""
        motion = self._motion((q, qd, qdd))
        into = self._accepted("passive_torque", motion, out)
        side = self._backend.side(motion[0])
        values = passive_torques(side, self._structure.passive_sums, *motion)
        if into is None:
            return PassiveTorque(*values)
        for place, value in zip(into, values, strict=True):
            place[...] = value
        return PassiveTorque(*out)

    def _check_rigid(self) -> None:
        if self._backend.rule is None:
            raise ValueError(
                f"{self._structure.name} on {self._backend.name} has no regressors, which come from the rule "
                "for rigid links; load numpy, torch or native of a robot of rigid links"
            )

    def _answer(self, call: str, given: Sequence[Any], out: Any) -> Any:
        """Answer to q, qd and, for most calls, qdd, as they were given."""
        motion = self._motion(given)
        kind = KINDS.get(call)
        if out is None:
            values = self._computed(call, motion)
            return kind(*values) if kind else values[0]
        into = self._accepted(call, motion, out)
        self._compute_into(call, motion, into)
        return kind(*out) if kind else out

    def _motion(self, given: Sequence[Any], names: Sequence[str] = MOTION) -> Any:
        """The motion as the back end computes with it, in one shape, and looked at if that was asked for."""
        named = dict(zip(names, given, strict=False))
        arrays = self._backend.arrays(named, self._structure.n)
        if self._check_finite:
            check_numbers(named, self._structure.joint_names)
        return arrays

    def _accepted(self, call: str, motion: Sequence[Any], out: Any, names: Sequence[str] = MOTION) -> Any:
        if out is None:
            return None
        kind, named = KINDS.get(call), dict(zip(names, motion, strict=False))
        fields = kind._fields if kind else ()
        return accepted(out, fields, self._shapes[call], named, self.read_beside_motion(), self.contiguous)

    def _computed(self, call: str, motion: Any) -> Any:
        """Results of a call in order."""
        return getattr(self._composed, call)(*motion)

    def _compute_into(self, call: str, motion: Any, into: Any) -> None:
        """Compute a call's results where these arrays or tensors lie."""
        for place, value in zip(into, self._computed(call, motion), strict=True):
            place[...] = value
