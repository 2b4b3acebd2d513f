"""The calls that every back end answers.

Index i is the joint that is loaded, j the link through which it is loaded (by the link's motion and weight),
k the coordinate that moves.

    tau_ij = sum_k c2_ijk qdd_k + sum_k c1_ijk qd_k + g_ij

tau_ij is zero off the path of link j, so results are kept packed, beside a list of their indices; dense
tensors are a view that is built on request.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from types import MethodType
from typing import Any, Literal, overload

from numpy.typing import ArrayLike

from .controller_calls import ControllerCalls
from .interface import Array, Backend
from .labelled import labelled
from .motion_calls import MotionCalls
from .quantities import Coefficients, GradientPropagation, Packed, PassiveTorque, Propagation
from .robot_constraints import Constraints, Contact
from .robot_kinematics import Kinematics
from .robot_table import robot_table
from .structure import JointLimits, Layout, Structure
from .sum_calls import SumCalls


class Dynamics(SumCalls, MotionCalls, ControllerCalls):
    """Partial torques of a robot on one back end; made by the package's `load`.

    The robot is the open tree of its joints: of one with ties, which close loops, or with contacts, calls are
    as if these were cut, and `constraints` has what they leave.

    q, qd, qdd: positions, velocities and accelerations of shape (..., n): rad, rad/s, rad/s^2 for a revolute
    joint, m, m/s, m/s^2 for a prismatic one. They are arrays, tensors, lists or tuples, as `load` says; the
    shapes before the last axis broadcast.

    Answers are arrays or tensors, as the back end computes with, of float32 or float64 as the motion is, on
    its device; torques in N m, or N where joint i is prismatic.

    out: where the answer is written, and what is then returned: an array or tensor of its shape and dtype,
    writable, apart from the motion and, for native, contiguous; several of them, in order, where there are
    several results. What cannot hold the answer is refused by name, as is any where a gradient is recorded.

    Every call raises ValueError for a wrong shape, and TypeError for what cannot be taken without a doubt;
    the message names the argument.
    """

    name: str
    """Name of the package."""
    n: int
    """Number of joints."""
    N: int
    """Number of links."""
    joint_names: tuple[str, ...]
    """Names of the joints, in the order of i and k."""
    joint_units: tuple[str, ...]
    """Unit of each joint's position: rad or m."""
    joint_limits: JointLimits
    """Each joint's lower, upper, velocity and effort limit, as its file has it; no call keeps to them."""
    link_names: tuple[str, ...]
    """Names of the links, in the order of j."""
    layout: Layout
    """Indices that packed values belong to."""
    structure: Structure
    """Names, paths and parameters, as the package's names.py has them."""
    backend: Backend[Any]
    """What computes; of the native one `threads` may be set."""
    check_finite: bool
    """Whether every call looks for NaN and infinity in the motion first."""

    def __init__(
        self,
        structure: Structure,
        backend: Backend[Any],
        load: Callable[..., "Dynamics"],
        asked: tuple[Any, ...],
        check_finite: bool = False,
    ) -> None:
        """`load` makes this robot again from the arguments that it was `asked` with."""
        self.name, self.check_finite = structure.name, check_finite
        self.n, self.N = structure.n, structure.N
        self.joint_names, self.joint_units = structure.joint_names, structure.joint_units
        self.joint_limits = structure.joint_limits
        self.link_names, self.layout = structure.link_names, structure.layout
        self.structure, self.backend = structure, backend
        self._load, self._asked = load, asked
        self._answers = backend.answers(check_finite)
        # They stand before the methods of the class, which they pass on to what is no plain array.
        vars(self).update({name: MethodType(call, self) for name, call in self._answers.direct.items()})

    def __dir__(self) -> Iterable[str]:
        """Names of what this robot has: torch.jit reads each of them, whose values may not raise."""
        tree = self.backend.tree
        absent = {"kinematics", "constraints"} if tree is None else set() if tree.tied else {"constraints"}
        return sorted(set(super().__dir__()) - absent)

    @property
    def parameters(self) -> Mapping[str, Any]:
        """Values of the run-time parameters."""
        values: Mapping[str, Any] = self.backend.parameters
        return values

    @cached_property
    def kinematics(self) -> Kinematics[Any]:
        """Poses, Jacobians and their rates of the robot's frames; raises ValueError for links of energies."""
        return Kinematics(self.backend.kinematics(self.check_finite, self._answers.read_beside_motion))

    @cached_property
    def constraints(self) -> Constraints[Any]:
        """What the ties and couplings of the robot's file leave of its motion, see `Constraints`.

        Raises ValueError for a robot without any, and for links of energies.
        """
        return Constraints(self.backend.constraints(self, None, (), None, None))

    def constrained(
        self,
        independent: Sequence[int | str] | None = None,
        contacts: Sequence[Contact] = (),
        at: Array | None = None,
        tolerance: float | None = None,
    ) -> Constraints[Any]:
        """`constraints` with contacts besides, or other independent joints; of a robot without ties too.

        independent: joints by number or by name; unless given, the file's where there are no contacts, and
        else those that pivoting leaves, of a floating base as few as can be
        at: positions (n,) in which loops close, where joints are chosen; unless given, some that were found
        tolerance: largest violation of a tie, in m or rad, that calls take; unless given, 1e-6, in float32
        1e-4, of what joints could close, and 1e-4 of the rest: right angles of 1.5708 in files leave some
        micrometres that nothing closes

        Raises ValueError for what is not there, for joints on which the others do not hang at `at`, and
        where nothing is left to move.
        """
        return Constraints(self.backend.constraints(self, independent, contacts, at, tolerance))

    def module(self, call: str, **fixed: Any) -> Any:
        """One call as a torch.nn.Module, such as torch.export, ONNX and containers take.

        call: its name, such as "partial_torque" or "kinematics.jacobian"
        fixed: what every call is given besides: frame="tool", passive=True

        The module takes the rest by the call's own names, and answers with a dict by name where there are
        several results. Run-time parameters, and bodies that were given, are in its state_dict. For torch and
        autograd; raises TypeError on another back end, ValueError for a call or argument that is not there.
        """
        return self.backend.module(self, call, fixed)

    def labelled(self, call: str, *given: Any, along: Any = None, **named: Any) -> Any:
        """The answer of a call with names along its axes: an xarray DataArray, or a Dataset of several.

        call: its name, such as "partial_torque", "kinematics.jacobian" or "constraints.forces"; the call's
        own arguments follow. Arguments may be DataArrays: joints are then found by their names, whatever
        their order, and the other axes, such as time, are those of the answer.
        along: names of the axes of samples without names: "time", ("trial", "time") or {"time": instants};
        sample unless given

        labelled("partial_torque", q, qd, qdd).sel(joint="knee", link="foot") is tau_ij. Axes are joint i,
        link j, cause k; `order` tells shares by acceleration from those by velocity. The attribute `units`
        has the unit; where joints of angles and of lengths differ, `units_from` names the coordinate with it.
        Values are NumPy's arrays, without gradients.

        Raises ImportError without xarray, ValueError for a call without such axes, such as packed, or a joint
        that an argument lacks, and what the call raises.
        """
        return labelled(self, None, call, given, named, along)

    def _repr_html_(self) -> str:
        """What a notebook shows: joints with unit and limits, links with the joints that move them."""
        return robot_table(self.structure, repr(self).strip("<>"))

    def __repr__(self) -> str:
        counts = {"joint": self.n, "link": self.N, "parameter": len(self.parameters)}
        parts = [f"{count} {what}{'s' * (count != 1)}" for what, count in counts.items() if count]
        return f"<{self.name} on {self.backend.name}: {', '.join(parts)}>"

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickled, copied or sent to another process, it is loaded again there; threads set here stay."""
        return self._load, self._asked, getattr(self.backend, "threads_set", None)

    def __setstate__(self, threads: int) -> None:
        """Set threads as they were set of the robot that this one is a copy of."""
        backend: Any = self.backend
        backend.threads = threads

    def packed(self, q: Array, qd: Array, qdd: Array, out: Sequence[Array] | None = None) -> Packed[Array]:
        """Full decomposition without the zeros: c2, c1 (closing), g, tau, h1, (..., count) each."""
        answer: Packed[Array] = self._answers.packed(q, qd, qdd, out)
        return answer

    def packed_torque(self, q: Array, qd: Array, qdd: Array, out: Array | None = None) -> Array:
        """tau_ij on the paths only, (..., count); its indices are `layout.torque`."""
        tau: Array = self._answers.packed_torque(q, qd, qdd, out)
        return tau

    def partial_torque(self, q: Array, qd: Array, qdd: Array, out: Array | None = None) -> Array:
        """tau_ij, the torque on joint i through link j, shape (..., n, N)."""
        tau: Array = self._answers.partial_torque(q, qd, qdd, out)
        return tau

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array, out: Array | None = None) -> Array:
        """tau_i = sum_j tau_ij, shape (..., n): of the links, without what `passive_torque` has."""
        tau: Array = self._answers.inverse_dynamics(q, qd, qdd, out)
        return tau

    def passive_torque(
        self, q: Array, qd: Array, qdd: Array, out: Sequence[Array] | None = None
    ) -> PassiveTorque[Array]:
        """What joints take for their own springs, damping, Coulomb friction and armature, (..., n) each.

        No tau_ij holds it: actuators give inverse_dynamics(q, qd, qdd) + passive_torque(q, qd, qdd).total.
        Zeros where the robot's description has none.
        """
        answer: PassiveTorque[Array] = self._answers.passive_torque(q, qd, qdd, out)
        return answer

    def coefficients(self, q: Array, qd: Array, out: Sequence[Array] | None = None) -> Coefficients[Array]:
        """c2, c1 (..., n, N, n) and g (..., n, N) of the closing convention."""
        answer: Coefficients[Array] = self._answers.coefficients(q, qd, out)
        return answer

    @overload
    def propagation(
        self,
        q: Array,
        qd: Array,
        qdd: Array,
        convention: Literal["closing"] = ...,
        out: Sequence[Array] | None = None,
    ) -> Propagation[Array]: ...
    @overload
    def propagation(
        self,
        q: Array,
        qd: Array,
        qdd: Array,
        convention: Literal["gradient"],
        out: Sequence[Array] | None = None,
    ) -> GradientPropagation[Array]: ...
    def propagation(
        self,
        q: Array,
        qd: Array,
        qdd: Array,
        convention: str = "closing",
        out: Sequence[Array] | None = None,
    ) -> Propagation[Array] | GradientPropagation[Array]:
        """Motion propagation torques c2_ijk qdd_k and c1_ijk qd_k (..., n, N, n), and g_ij (..., n, N).

        closing: over all coordinates and orders they sum to tau_ij. gradient: c1 = d(tau_ij)/d(qd_k), the
        paper's Eq. 1 to the letter, whose velocity part sums to twice the velocity force. Any other word
        raises ValueError.
        """
        answer: Propagation[Array] | GradientPropagation[Array]
        answer = self._answers.propagation(q, qd, qdd, convention, out)
        return answer

    def position_gradient(self, q: Array, qd: Array, qdd: Array, out: Array | None = None) -> Array:
        """c0_ijk = d(tau_ij)/d(q_k), the partial stiffness, shape (..., n, N, n)."""
        c0: Array = self._answers.position_gradient(q, qd, qdd, out)
        return c0

    def regressor(self, q: Array, qd: Array, qdd: Array, out: Array | None = None) -> Array:
        """Y_ij, what tau_ij multiplies link j's inertial parameters by, shape (..., n, N, 10).

        tau_ij = Y_ij . pi_j, whatever the link carries: pi_j = (m, mc_x, mc_y, mc_z, I_xx, I_xy, I_yy, I_xz,
        I_yz, I_zz) in kg, kg m and kg m^2, I about the origin of the link's frame and in its axes, as the
        package's inertial_parameters(bodies()) are. For numpy, torch and native, and for rigid links; raises
        ValueError for others.
        """
        rows: Array = self._answers.regressor(q, qd, qdd, out)
        return rows

    def coefficient_regressors(
        self, q: Array, qd: Array, out: Sequence[Array] | None = None
    ) -> Coefficients[Array]:
        """The same of c2 and c1 (..., n, N, n, 10) and of g (..., n, N, 10), closing: Y split by k and order.

        c2_ijk = Y_ijk . pi_j, c1_ijk and g_ij likewise. Raises as `regressor` does.
        """
        answer: Coefficients[Array] = self._answers.coefficient_regressors(q, qd, out)
        return answer

    def masked(
        self, q: Array, qd: Array, qdd: Array, mask: ArrayLike | Array, out: Array | None = None
    ) -> Array:
        """sum over m, k of mask_mk c_m,ijk q_k^(m) (the paper's Eq. 21-23), shape (..., n, N).

        mask: shape (3, n), zeros and ones, or weights between; row m is the order: 0 position, 1 velocity,
        2 acceleration. Gravity is in no row: a mask of ones in rows 1 and 2 gives tau_ij - g_ij.
        """
        torque: Array = self._answers.masked(q, qd, qdd, mask, out)
        return torque

    def graph(self, i: Any, j: Any = None, k: Any = None, m: int | None = None) -> Any:
        """Autograd's graph of tau_ij, or of a part of it, as a `TorqueGraph`; on the autograd back end only.

        i, j, k: joint, link and joint by number from 0 or by name; several links, or without
        j all of them, are summed
        k and m: the part c_m,ijk q_k^(m) of the closing convention, m = 2 acceleration, 1 velocity, and for 0
        the stiffness c0 times the position; k alone is both shares of a motion, m alone all of an order, 0
        gravity

        What torch computes while it differentiates the energies is recorded; nothing was derived beforehand.
        Raises TypeError on another back end, ValueError for a joint, a link or an order that is not there.
        """
        return self._recording("graph")(i, j, k, m)

    def graph_parts(self, i: Any, j: Any = None) -> Any:
        """Graphs of all parts (k, m) of tau_ij that are not zero, and of gravity: they sum to it."""
        return self._recording("graph_parts")(i, j)

    def _recording(self, call: str) -> Callable[..., Any]:
        found: Callable[..., Any] | None = getattr(self.backend, call, None)
        if found is None:
            raise TypeError(f"{self.backend.name} records no operations; load autograd for graphs")
        return found
