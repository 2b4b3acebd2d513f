"""Calls that every back end answers.

Index i is the joint that is loaded, j the link through which it is loaded (by the link's motion and weight),
k the coordinate that moves.

    tau_ij = sum_k c2_ijk qdd_k + sum_k c1_ijk qd_k + g_ij

tau_ij is zero off the path of link j, so results are kept packed, with a list of their indices; dense tensors
are built on request. The arguments and the answer of each call are a row of `call_table.CALLS`.
"""

import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import Any, Literal, Self, cast, overload

from numpy.typing import ArrayLike

from .arguments import Beside, check_numbers
from .certainty_calls import CertaintyCalls
from .control.cancellation import Cancellation, cancellation
from .control.controller import Stance
from .control.controllers import PartialImpedance, partial_impedance
from .file_joints import Order
from .html_tables import robot_table
from .interface import Array
from .kinematics.robot_kinematics import Kinematics
from .labelled import labelled
from .quantities import (
    Coefficients,
    Energy,
    GradientPropagation,
    NaturalImpedance,
    Packed,
    PassiveTorque,
    Power,
    Propagation,
)
from .targets import FrameImpedance, Grip, Natural


class Dynamics(CertaintyCalls):
    """Partial torques and other dynamics of a robot on one back end; made by the package's `load`.

    The robot is the open tree of its joints: unless they say otherwise, calls compute as if ties, which close
    loops, and contacts were cut; `constraints` has the calls on the motion that these leave.

    q, qd, qdd: positions, velocities and accelerations of shape (..., n): rad, rad/s, rad/s^2 for a revolute
    joint, m, m/s, m/s^2 for a prismatic one. They are arrays, tensors, lists or tuples, as `load` says; the
    shapes before the last axis broadcast.

    Answers are arrays or tensors, whichever the back end computes with, in float32 or float64 as the motion
    is, on its device; torques are in N m, or N where joint i is prismatic.

    out: array or tensor that the answer is written to, and that is then returned: of the answer's shape and
    dtype, writable, in memory apart from the motion and, for native, contiguous; several of them, in order,
    where there are several results. One that cannot hold the answer is refused by name, and so is any where a
    gradient is recorded.

    Every call raises ValueError for a wrong shape, and TypeError for an argument that cannot be read without
    ambiguity; the message names the argument.
    """

    def __init__(self, *made: Any) -> None:
        """Set up the robot, as `RobotCalls` does."""
        super().__init__(*made)
        if self.backend.takes_tensors and self.backend.tree is not None:
            _ = self.kinematics  # no compiler follows how a first look makes it

    def __dir__(self) -> Iterable[str]:
        """Return the names of this robot's attributes: torch.jit reads each of them, and none may raise."""
        absent = {"kinematics"} if self.backend.tree is None else set()
        absent |= set() if self.backend.ties_joints else {"constraints"}
        return sorted(set(super().__dir__()) - absent)

    @property
    def parameters(self) -> Mapping[str, Any]:
        """Values of the run-time parameters by name."""
        return self.backend.parameters

    @property
    def share_names(self) -> tuple[str, ...]:
        """Names of the shares that `named_shares` returns."""
        return self.structure.share_names

    @property
    def tree_joint_names(self) -> tuple[str, ...]:
        """Names of the tree's joints, in the order of `reactions`; none for links given by energies."""
        tree = self.backend.tree
        return () if tree is None else tuple(joint.name for joint in tree.joints)

    def at(self, **values: Any) -> Self:
        """Return the robot at a time, or with inputs, given by their names: robot.at(t=0.2, F=force).

        Each is one number, or for numpy, torch and autograd an array (...) of one for each sample. Other
        run-time parameters may be named too. Raises as the package's `load` does.
        """
        backend, parameters, *others = self._asked
        robot = cast(Self, self._load(backend, {**parameters, **values}, *others))
        robot.backend.threads_set = self.backend.threads_set
        return robot

    @cached_property
    def kinematics(self) -> Kinematics[Any]:
        """Poses, Jacobians and their rates of the robot's frames; ValueError for links given by energies."""
        return Kinematics(self, self.backend.frames.names)

    def module(self, call: str, **fixed: Any) -> Any:
        """Return one call as a torch.nn.Module, as accepted by torch.export, ONNX and containers.

        call: its name, such as "partial_torque" or "kinematics.jacobian"
        fixed: arguments that are the same in every call: frame="tool", passive=True

        The module accepts the other arguments by the call's own names, and returns a dict by name where there
        are several results. Run-time parameters, and bodies that were given, are in its state_dict. For torch
        and autograd; raises TypeError on another back end, ValueError for a call or argument that does not
        exist.
        """
        return self.backend.module(self, call, fixed)

    def labelled(self, call: str, *given: Any, along: Any = None, **named: Any) -> Any:
        """Return the answer of a call with named axes: an xarray DataArray, or a Dataset of several.

        call: its name, such as "partial_torque", "kinematics.jacobian" or "constraints.forces"; the call's
        own arguments follow. Arguments may be DataArrays: joints are then matched by their names, in any
        order, and the other axes, such as time, are those of the answer.
        along: names of the axes of samples without names: "time", ("trial", "time") or {"time": instants};
        sample unless given

        labelled("partial_torque", q, qd, qdd).sel(joint="knee", link="foot") is tau_ij. Axes are joint i,
        link j, cause k; `order` separates shares by acceleration from those by velocity. The attribute
        `units` has the unit; where it differs, as between joints with angles and with lengths, `units_from`
        names the coordinate that has it. Values are NumPy arrays, without gradients.

        Raises ImportError without xarray, ValueError for a call without named axes, such as packed, or for a
        joint that an argument lacks, and whatever the call raises.
        """
        return labelled(self, None, call, given, named, along)

    def _repr_html_(self) -> str:
        """Return HTML for notebooks: joints with unit and limits, links with the joints that move them."""
        return robot_table(self.structure, repr(self).strip("<>"))

    def __repr__(self) -> str:
        counts = {"joint": self.n, "link": self.N, "parameter": len(self.parameters)}
        parts = [f"{count} {what}{'s' * (count != 1)}" for what, count in counts.items() if count]
        return f"<{self.name} on {self.backend.name}: {', '.join(parts)}>"

    def packed(self, q: Array, qd: Array, qdd: Array, out: Sequence[Array] | None = None) -> Packed[Array]:
        """Return the full decomposition without zeros: c2, c1 (closing), g, tau, h1, (..., count) each."""
        answer: Packed[Array] = self._call("packed", (q, qd, qdd), out)
        return answer

    def packed_torque(self, q: Array, qd: Array, qdd: Array, out: Array | None = None) -> Array:
        """Return tau_ij on the paths only, (..., count); its indices are `layout.torque`."""
        tau: Array = self._call("packed_torque", (q, qd, qdd), out)
        return tau

    def partial_torque(self, q: Array, qd: Array, qdd: Array, out: Array | None = None) -> Array:
        """Return tau_ij, the torque on joint i through link j, shape (..., n, N), in N m or N."""
        tau: Array = self._call("partial_torque", (q, qd, qdd), out)
        return tau

    def inverse_dynamics(self, q: Array, qd: Array, qdd: Array, out: Array | None = None) -> Array:
        """Return tau_i = sum_j tau_ij, shape (..., n): of the links alone, without `passive_torque`."""
        tau: Array = self._call("inverse_dynamics", (q, qd, qdd), out)
        return tau

    def passive_torque(
        self, q: Array, qd: Array, qdd: Array, out: Sequence[Array] | None = None
    ) -> PassiveTorque[Array]:
        """Return the torques that springs, damping, Coulomb friction and armature require, (..., n) each.

        No tau_ij contains them: actuators give
        inverse_dynamics(q, qd, qdd) + passive_torque(q, qd, qdd).total. Zeros where the robot's description
        has none.
        """
        answer: PassiveTorque[Array] = self._call("passive_torque", (q, qd, qdd), out)
        return answer

    def coefficients(self, q: Array, qd: Array, out: Sequence[Array] | None = None) -> Coefficients[Array]:
        """Return c2, c1 (..., n, N, n) and g (..., n, N) of the closing convention."""
        answer: Coefficients[Array] = self._call("coefficients", (q, qd), out)
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
        """Return motion propagation torques c2_ijk qdd_k, c1_ijk qd_k (..., n, N, n) and g_ij (..., n, N).

        convention: closing: over all coordinates and orders they sum to tau_ij. gradient: c1 =
        d(tau_ij)/d(qd_k), the paper's Eq. 1 to the letter, whose velocity part sums to twice the velocity
        force. Any other word raises ValueError.
        """
        answer: Propagation[Array] | GradientPropagation[Array]
        if convention not in ("closing", "gradient"):
            raise ValueError(f"no convention {convention!r}; choose closing or gradient")
        key = "propagation" if convention == "closing" else "gradient_propagation"
        answer = self._call(key, (q, qd, qdd), out)
        return answer

    def named_shares(self, q: Array, qd: Array, out: Array | None = None) -> Array:
        """Return the shares of tau_ij that are not of motion, by their names, shape (..., n, N, M).

        They sum to g_ij, and stand in the order of `share_names`: gravity of rigid links, and of links that
        were written by hand each potential, dissipation and force, and what an imposed motion asks for.
        """
        shares: Array = self._call("named_shares", (q, qd), out)
        return shares

    def position_gradient(self, q: Array, qd: Array, qdd: Array, out: Array | None = None) -> Array:
        """Return c0_ijk = d(tau_ij)/d(q_k), the partial stiffness, shape (..., n, N, n)."""
        c0: Array = self._call("position_gradient", (q, qd, qdd), out)
        return c0

    def regressor(self, q: Array, qd: Array, qdd: Array, out: Array | None = None) -> Array:
        """Return Y_ij, which maps link j's inertial parameters to tau_ij, shape (..., n, N, 10).

        tau_ij = Y_ij . pi_j, whatever the link carries: pi_j = (m, mc_x, mc_y, mc_z, I_xx, I_xy, I_yy, I_xz,
        I_yz, I_zz) in kg, kg m and kg m^2, I about the origin of the link's frame and in its axes, as
        returned by the package's inertial_parameters(bodies()). For numpy, torch and native, and for rigid
        links; raises ValueError for others.
        """
        rows: Array = self._call("regressor", (q, qd, qdd), out)
        return rows

    def coefficient_regressors(
        self, q: Array, qd: Array, out: Sequence[Array] | None = None
    ) -> Coefficients[Array]:
        """Return the regressors of c2 and c1 (..., n, N, n, 10) and of g (..., n, N, 10), closing convention.

        They are Y split by k and order: c2_ijk = Y_ijk . pi_j, c1_ijk and g_ij likewise. Raises as
        `regressor` does.
        """
        answer: Coefficients[Array] = self._call("coefficient_regressors", (q, qd), out)
        return answer

    def masked(
        self, q: Array, qd: Array, qdd: Array, mask: ArrayLike | Array, out: Array | None = None
    ) -> Array:
        """Return sum over m, k of mask_mk c_m,ijk q_k^(m) (the paper's Eq. 21-23), shape (..., n, N).

        mask: shape (3, n), zeros and ones, or weights between; row m is the order: 0 position, 1 velocity, 2
        acceleration. Gravity is in no row: a mask of ones in rows 1 and 2 gives tau_ij - g_ij.
        """
        backend, motion = self.door.read({"q": q, "qd": qd, "qdd": qdd})
        weights = backend.weights("the mask", mask, motion[0])
        if tuple(weights.shape) != (3, self.n):
            raise ValueError(
                f"the mask has shape {tuple(weights.shape)}; it must be (3, {self.n}): order, coordinate"
            )
        if self.door.check_finite:
            check_numbers({}, (), {"the mask": Beside(mask, (3, self.n), "order, coordinate")})
        torque: Array = self._answer("masked", backend, motion, out, (weights,))
        return torque

    def graph(self, i: Any, j: Any = None, k: Any = None, m: int | None = None) -> Any:
        """Return autograd's graph of tau_ij, or of a part of it, as a `TorqueGraph`; autograd back end only.

        i, j, k: joint, link and joint by number from 0 or by name; several links, or all of them without j,
        are summed
        k and m: the part c_m,ijk q_k^(m) of the closing convention: m is 2 for acceleration, 1 for velocity,
        and 0 for the stiffness c0 times the position; k alone is both shares of a motion, m alone all shares
        of an order, 0 gravity

        The graph records what torch computes while it differentiates the energies; nothing was derived
        beforehand.
        Raises TypeError on another back end, ValueError for a joint, a link or an order that does not exist.
        """
        return self._recording("graph")(i, j, k, m)

    def graph_parts(self, i: Any, j: Any = None) -> Any:
        """Return the graphs of all nonzero parts (k, m) of tau_ij, and of gravity: they sum to tau_ij."""
        return self._recording("graph_parts")(i, j)

    def _recording(self, call: str) -> Callable[..., Any]:
        found: Callable[..., Any] | None = getattr(self.backend, call, None)
        if found is None:
            raise TypeError(f"{self.backend.name} records no operations; load autograd for graphs")
        return found

    def joint_index(self, joint: int | str) -> int:
        """Return index i or k of a joint by number from 0 or by name; raise ValueError for any other."""
        return self.structure.joint_index(joint)

    def link_index(self, link: int | str) -> int:
        """Return index j of a link by number from 0 or by name; raise ValueError for any other."""
        return self.structure.link_index(link)

    def mass_matrix(self, q: Array, *, by_link: bool = False, out: Array | None = None) -> Array:
        """Return the mass matrix M_ik = sum_j c2_ijk, shape (..., n, n); by link c2_ijk, (..., n, N, n).

        In kg m^2, kg m or kg, where none, one or both of i and k are prismatic. Raises ValueError for links
        with kinetic energies of degree three or more in the velocities, which M then depends on.
        """
        if max(self.structure.degrees, default=2) > 2:
            raise ValueError(
                f"the mass matrix of {self.structure.name} depends on the velocities too; sum c2 of "
                "coefficients(q, qd) over the links"
            )
        mass: Array = self._call("mass_matrix_by_link" if by_link else "mass_matrix", (q,), out)
        return mass

    def coriolis_matrix(
        self, q: Array, qd: Array, *, by_link: bool = False, out: Array | None = None
    ) -> Array:
        """Return the Coriolis matrix C_ik = sum_j c1_ijk, shape (..., n, n); by link c1_ijk, (..., n, N, n).

        C qd is the velocity force; c1 is that of the closing convention. For rigid links C is the matrix of
        Christoffel symbols: dM/dt - 2 C is skew-symmetric.
        """
        coriolis: Array = self._call(
            "coriolis_matrix_by_link" if by_link else "coriolis_matrix", (q, qd), out
        )
        return coriolis

    def gravity_torque(self, q: Array, *, by_link: bool = False, out: Array | None = None) -> Array:
        """Return g_i = sum_j g_ij at rest, (..., n); by link (..., n, N).

        It is the torque of gravity, or of all shares with names of links that were written by hand.
        """
        gravity: Array = self._call("gravity_torque_by_link" if by_link else "gravity_torque", (q,), out)
        return gravity

    def forward_dynamics(
        self, q: Array, qd: Array, tau: Array, passive: bool = True, out: Array | None = None
    ) -> Array:
        """Return qdd of M qdd + C qd + g + p = tau, shape (..., n), in rad/s^2 or m/s^2.

        tau: torques of the actuators, (..., n), in N m or N
        p: total of `passive_torque`, which contains armature times qdd
        passive: whether joints have their springs, damping, friction and armature; False leaves p out: tau is
        then for the links alone, and this call the inverse of `inverse_dynamics`

        Raises ValueError for a robot with ties, whose joints move as `constraints.forward_dynamics` says, and
        for a singular mass matrix, with the sample and the joints that can move without moving any mass;
        inside torch.func and torch.compile, qdd is then not finite. Warns where rounding leaves fewer than
        half of the digits of M^-1, as near 90 degrees of a floating base's pitch, and says how many are left.
        """
        if self.backend.ties_joints:
            raise ValueError(
                f"the joints of {self.structure.name} are tied, which its open tree does not know; call "
                "constraints.forward_dynamics(q, qd, tau)"
            )
        key = "forward_dynamics" if passive else "forward_dynamics_of_links"
        qdd: Array = self._call(key, (q, qd, tau), out)
        return qdd

    def energy(self, q: Array, qd: Array, out: Sequence[Array] | None = None) -> Energy[Array]:
        """Return the kinetic and potential energy of each link in J, (..., N) each.

        The potential energy of rigid links is zero at the world's origin. Of links that were written by hand
        the kinetic energy is that of the terms of degree two in the velocities, and of those of degree d it
        has d - 1 times as much: their sum is what only torques and shares without potential change.
        """
        answer: Energy[Array] = self._call("energy", (q, qd), out)
        return answer

    def power(self, q: Array, qd: Array, qdd: Array, out: Sequence[Array] | None = None) -> Power[Array]:
        """Return P_ij = tau_ij qd_i, the power in W that joint i sends into link j.

        It is split by the motion k that causes it and by order, with shapes (..., n, N, n) twice and (..., n,
        N); `.total` is P_ij. sum_i P_ij is the rate of link j's energy, sum_j P_ij the power of actuator i.
        """
        answer: Power[Array] = self._call("power", (q, qd, qdd), out)
        return answer

    def christoffel(self, q: Array, *, by_link: bool = False, out: Array | None = None) -> Array:
        """Return Gamma_ikl, the velocity share of every pair of motions, shape (..., n, n, n).

        By link, the shape is (..., n, N, n, n). sum_kl Gamma_ikl qd_k qd_l is the velocity force: Gamma_ikk
        qd_k^2 comes from joint k's motion alone, (Gamma_ikl + Gamma_ilk) qd_k qd_l from the motions of k and
        l together. Symmetric in k and l. Shares with names are not part of it. Raises ValueError for links
        with kinetic energies of degree three or more in the velocities.
        """
        symbols: Array = self._call("christoffel_by_link" if by_link else "christoffel", (q,), out)
        return symbols

    def from_qpos(
        self,
        qpos: ArrayLike,
        qvel: ArrayLike | None = None,
        qacc: ArrayLike | None = None,
        tau: ArrayLike | None = None,
        order: Order = "mujoco",
        joints: Sequence[str] | None = None,
    ) -> Any:
        """Return q for positions as MuJoCo or Pinocchio has them, and qd, qdd and torques if given.

        qpos: (..., nq), in which a joint that turns in space has a quaternion: MuJoCo's w, x, y, z, or
        Pinocchio's x, y, z, w, which also has a cosine and a sine for an angle without limits
        qvel, qacc, tau: (..., n), for which the answer is a tuple (q, qd), (q, qd, qdd), ...: velocities,
        accelerations and generalized forces of that simulator. Angular velocities are along the body's axes;
        a floating body's linear one is along the world's with MuJoCo, along its own with Pinocchio
        order: simulator whose numbers these are; the joints are in the file's order, or in Pinocchio's own
        joints: their names in the order of qpos, where it is another: list(model.names)[1:], say

        Joints that are locked or follow others have no numbers here. Angles do not jump along the samples,
        the last axis but one: whole turns are added, and beyond 90 degrees the pitch continues to grow.
        Arguments are read as arrays of float64, which the answers are too; gradients are not carried.

        Raises ValueError for a quaternion whose length is not 1 within 0.01, for velocities at a pitch of 90
        degrees, and for a wrong shape, saying which number belongs where; warns next to such a pitch.
        """
        found = self.structure.qpos(order, joints).motion(qpos, qvel, qacc, tau)
        for told in found.warnings:
            warnings.warn(told, stacklevel=2)
        motion = tuple(values for values in found[:4] if values is not None)
        return motion if len(motion) > 1 else motion[0]

    def natural_impedance(
        self, q: Array, qd: Array, qdd: Array, out: Sequence[Array] | None = None
    ) -> NaturalImpedance[Array]:
        """Return the changes of tau_ij with the motion of k: c2_ijk, 2 c1_ijk - h1_ijk and c0_ijk.

        Each has the shape (..., n, N, n): d(tau_ij) = sum_k c2_ijk d(qdd_k) + (2 c1_ijk - h1_ijk) d(qd_k) +
        c0_ijk d(q_k), where h1 is not zero for links with terms that are not quadratic in the velocities.
        """
        answer: NaturalImpedance[Array] = self._call("natural_impedance", (q, qd, qdd), out)
        return answer

    def partial_impedance(
        self,
        inertia: Any = Natural(),  # noqa: B008 - a tuple of numbers
        damping: Any = Natural(),  # noqa: B008
        stiffness: Any = 0.0,
        frame: FrameImpedance | None = None,
        passive: bool = True,
        friction_width: float | None = None,
        constraints: Any = None,
        actuated: Sequence[int | str] | None = None,
        torque_weight: Sequence[float] | None = None,
        grips: Sequence[Grip] = (),
    ) -> PartialImpedance[Array]:
        """Return a controller under which shares of inertia, damping and stiffness are as asked.

        inertia, damping, stiffness: targets, each one of
            Natural(scale, plus)            c2_ijk or c1_ijk as they are, or scaled by alpha_ij, and more
            {(joint, link, coordinate): x}  these entries in place of the natural ones, by name or number
            (n, N, n)                       all entries
            (n, n), (n,) or a number        their sum over the links; a diagonal; the same at every joint
        in kg m^2, N m s/rad and N m/rad, or the units of prismatic joints. Stiffness has no natural part:
        the torques that depend on positions alone are those of gravity, which is compensated.
        frame: target impedance of a frame; the joints' targets are then for the motion that it leaves free
        passive: whether the joints' own springs and damping are compensated, and their armature kept as part
        of the inertia, beside the links; else they are ignored, which is right only where the description has
        none. An inertia that is given as a sum is the whole, armature included.
        friction_width: None, and the joints' Coulomb friction is not compensated: it jumps at rest, and so
        would torques, with the noise of a sensor. Else a velocity w in rad/s or m/s: friction tanh(qd / w) is
        compensated, 0.76 of the friction at w and 0.999 of it at 3.8 w.

        constraints: as in `induced_accelerations`: ties and contacts under which the targets hold
        actuated: joints that something drives, by number or name; unless given, all of an open tree, of ties
        the independent joints, and with contacts all but those of a floating base and those that follow by
        the file's ties
        torque_weight: W of the least u^T W u where several torques of these do the same, a number above 0 for
        each; ones unless given
        grips: limits of contacts, each a `Grip`: of the torques that do, the least that keep all of them, as
        `Grips` says; calls raise ValueError with the contacts where none do, and need Clarabel and SciPy

        Tensors among the targets are read anew at each call, so that gains can be learned, and are refused
        there where they are no longer positive.

        Raises ValueError for names that do not exist or wrong shapes, and for a target that is not positive:
        an inertia that is not positive definite or not symmetric, a stiffness or a damping that adds energy;
        and for a frame of a robot with motions that nothing drives.
        """
        stance = Stance(constraints, actuated, torque_weight, grips)
        return partial_impedance(self, stance, inertia, damping, stiffness, frame, passive, friction_width)

    def cancel(
        self,
        entries: Iterable[Any],
        passive: bool = True,
        friction_width: float | None = None,
        constraints: Any = None,
        actuated: Sequence[int | str] | None = None,
        torque_weight: Sequence[float] | None = None,
        grips: Sequence[Grip] = (),
    ) -> Cancellation[Array]:
        """Return a controller that cancels gravity and chosen motion propagation torques, and no others.

        entries: (joint, link, coordinate, order): c2_ijk qdd_k for the order 2 and c1_ijk qd_k for 1 (closing
        convention), by name or number; None in a place stands for all. The effect of link 3's motion on the
        root is {("joint1", "link3", None, None)}.
        other arguments: as in `partial_impedance`

        Raises ValueError for an entry that does not exist, such as a joint that is not on the path of the
        link, or that is given twice. Calls raise it where what is left has no regular mass matrix, and warn
        where rounding leaves fewer than half of the digits of the acceleration, unless they are given qdd.
        """
        stance = Stance(constraints, actuated, torque_weight, grips)
        return cancellation(self, stance, entries, passive, friction_width)
