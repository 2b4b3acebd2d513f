"""Compiled C on NumPy arrays and torch CPU tensors."""

import sys
from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar, cast

import numpy as np
from numpy.typing import ArrayLike

from ..answers.answers import Answers
from ..answers.packed import AskedMotion, ReachedMotion, TiedFunctions, TorqueOfOne
from ..arguments import NOTHING, Beside, as_given, has_tensors
from ..arrays.backend import ArrayBackend
from ..arrays.numpy_backend import NumpyBackend
from ..call_table import CALLS
from ..constraints.chosen_constraints import TreeConstraints
from ..control.frame_impedance import FrameTargets
from ..control.joint_impedance import JointTargets
from ..interface import ClosedForms, Numbers
from ..kinematics.link_wrenches import CauseWrenches
from ..rule.calls import RigidRule
from ..structure import Structure
from .calls import FUNCTIONS, LINK_WRENCHES, SHARE_VARIANCES, NativeCalls, checked_threads
from .compiled_calls import QuickCalls
from .constraints import NativeTies, has_functions
from .control import ControlCalls, NativeTorque
from .memory import NumberArray, NumberType, memory
from .motion_variances import motion_variances
from .motions import NativeMotions

if TYPE_CHECKING:
    from .operators import TorchSide


Arrays = Sequence[NumberArray]


class NativeAnswers(Answers):
    """Answers to the calls that C has for arrays; the other answers are composed of these."""

    contiguous = True

    def __init__(self, backend: ArrayBackend, quick: QuickCalls, control: ControlCalls | None) -> None:
        """Keep the compiled calls for arrays.

        control: C functions that take one sample; None for links that are given by their energies.
        """
        super().__init__(backend)
        self._quick, self._control, self._tied = quick, control, backend.ties_joints

    def compute_into(self, call: str, motion: Sequence[Numbers], into: Sequence[Numbers]) -> None:
        """Compute a call's results and write them to the arrays `into`."""
        if call in FUNCTIONS:
            self._quick.run(call, cast(Arrays, motion), cast(Arrays, into))
        else:
            super().compute_into(call, motion, into)

    def mass_matrix(self, q: Numbers) -> Sequence[Numbers]:
        """Return the mass matrix M (..., n, n), the only entry of a sequence."""
        found = self._of_one("mass_matrix", (q,))
        return super().mass_matrix(q) if found is None else (found,)

    def forward_dynamics(self, q: Numbers, qd: Numbers, tau: Numbers) -> Sequence[Numbers]:
        """Return qdd (..., n), the only entry of a sequence.

        Where C finds M singular, the calls for arrays say what is wrong.
        """
        found = self._accelerated("forward_dynamics", q, qd, tau)
        return super().forward_dynamics(q, qd, tau) if found is None else (found,)

    def forward_dynamics_of_links(self, q: Numbers, qd: Numbers, tau: Numbers) -> Sequence[Numbers]:
        """Return qdd (..., n) of the links alone, without springs, damping, friction or armature of joints.

        It is the only entry of a sequence. C has a separate function for it only where joints have any of
        these.
        """
        call = "forward_dynamics_of_links" if self._structure.passive else "forward_dynamics"
        found = self._accelerated(call, q, qd, tau)
        return super().forward_dynamics_of_links(q, qd, tau) if found is None else (found,)

    def _accelerated(self, call: str, *motion: Numbers) -> Numbers | None:
        """Return the accelerations that C finds; None where it has no such function, as for tied joints."""
        return None if self._tied else self._of_one(call, motion)

    def _of_one(self, call: str, motion: Sequence[Numbers]) -> Numbers | None:
        return None if self._control is None else self._control.answer(call, motion)


def _of_c(key: str) -> Callable[..., Sequence[Numbers]]:
    """Return a method that answers the call `key` by the compiled C."""

    def row(self: NativeAnswers, *motion: Numbers) -> Sequence[Numbers]:
        return self._quick.run(key, cast(Arrays, motion))

    return row


for _name in FUNCTIONS.keys() & CALLS.keys():
    setattr(NativeAnswers, _name, _of_c(_name))


class NativeBackend(NumpyBackend):
    """The native back end: computes with NumPy arrays itself, and with tensors through its `TorchSide`.

    Each parameter is one number for all samples.
    """

    name: ClassVar = "native"

    def __init__(
        self,
        structure: Structure,
        sources: Path,
        links: Sequence[ClosedForms] | None,
        parameters: Mapping[str, float | Numbers],
        rule: RigidRule | None = None,
    ) -> None:
        """Compile the C at the first call for this package; raise RuntimeError where that is not possible.

        sources: the package's folder of C
        links, rule: what torch differentiates, one or the other
        """
        super().__init__(structure, links, {}, rule)
        self._forms = links
        self.parameters = dict(parameters)
        self.calls = NativeCalls(structure, sources, parameters)
        self.quick = QuickCalls(self.calls)
        self.direct = self.quick.direct()
        self.at_once = None if self.direct else self.calls.at_once
        self.one_sample = None if self.tree is None else ControlCalls(self.calls)
        self._motions = None if self.tree is None else NativeMotions(self.calls, self.tree)
        if "torch" in sys.modules:
            _ = self.on_torch  # a compiler could not trace how it is made

    @property
    def threads(self) -> int:
        """Number of threads that a large batch may use: the number of cores unless set."""
        return self.calls.threads

    @threads.setter
    def threads(self, count: int) -> None:
        """Set the number of threads; raise TypeError or ValueError unless it is a whole number from 1 on."""
        self.threads_set = checked_threads(count)

    @property
    def threads_set(self) -> int | None:
        """Number of threads that a user has set; None where nobody has."""
        return self.calls.threads_set

    @threads_set.setter
    def threads_set(self, count: int | None) -> None:
        self.calls.threads_set = count

    @cached_property
    def answers(self) -> Answers:
        """Answers to the calls of the call table, for arrays that have been read."""
        return NativeAnswers(self, self.quick, cast("ControlCalls | None", self.one_sample))

    @cached_property
    def on_torch(self) -> "TorchSide":
        """Back end that computes with tensors."""
        from .operators import TorchSide  # it needs torch, which arrays do without

        return TorchSide(self.calls, self.quick.run, self._forms, self.rule)

    def read(
        self, named: Mapping[str, object], n: int, beside: Mapping[str, Beside] = NOTHING
    ) -> tuple[ArrayBackend, Sequence[Numbers]]:
        """Return the back end that computes, and its `arrays`: all tensors if one argument is a tensor."""
        if "torch" in sys.modules and has_tensors(as_given(named, beside).values()):
            return self.on_torch, self.on_torch.arrays(named, n, beside)
        return self, self.arrays(named, n, beside)

    def controller(self, joints: object, frame: object) -> TorqueOfOne | None:
        """Return the object by which C computes a torque for one sample; None for tied joints."""
        if self.ties_joints:
            return None
        targets, framed = cast(JointTargets, joints), cast("FrameTargets | None", frame)
        return NativeTorque(self.calls, self.tree is not None, targets, framed)

    def tied_functions(self, chosen: object, tolerance: float | None) -> TiedFunctions | None:
        """Return the functions of C for constraints that have been chosen."""
        if not has_functions(self.calls, chosen):
            return None
        return NativeTies(self.calls, cast(TreeConstraints, chosen), tolerance)

    def moved(self, asked: AskedMotion) -> ReachedMotion | None:
        """Return a motion over time as far as C gets; None for links that are given by their energies."""
        return None if self._motions is None else self._motions.moved(asked)

    def separate(self) -> ArrayBackend:
        """Return a copy whose parameters may be set."""
        made = cast(NativeBackend, ArrayBackend.separate(self))
        made.calls = self.calls.separate()
        made.quick = QuickCalls(made.calls)
        made._motions = None  # whose numbers stay as they are
        made.direct, made.at_once = made.quick.direct(), None
        return made

    def set_parameters(self, values: Mapping[str, object]) -> None:
        """Give run-time parameters of a separate copy these values, one number each."""
        self.calls.parameters.update(cast("Mapping[str, float | Numbers]", values))

    def decomposition(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Sequence[Numbers]:
        """Return c2, c1, g, tau, h1, each (..., count) in the order of `Layout`."""
        return self._run("packed", q, qd, qdd)

    def torque(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return tau (..., count) in the order of `Layout.torque`."""
        return self._run("packed_torque", q, qd, qdd)[0]

    def position_gradient(self, q: Numbers, qd: Numbers, qdd: Numbers) -> Numbers:
        """Return c0 (..., count) in the order of `Layout.velocity`."""
        return self._run("packed_position_gradient", q, qd, qdd)[0]

    def product(self, a: Numbers, b: Numbers) -> Numbers:
        """Return the matrix products (..., l, n), in memory where large results lie one after another."""
        batch = np.broadcast_shapes(a.shape[:-2], b.shape[:-2])
        into = memory((*batch, a.shape[-2], b.shape[-1]), cast(NumberType, a.dtype))
        return cast(Numbers, np.matmul(cast(NumberArray, a), cast(NumberArray, b), out=into))

    def link_wrenches(self, q: Numbers, qd: Numbers) -> CauseWrenches:
        """Return the wrenches of links by cause, (..., N, X, 6), by C where no ties hold the joints."""
        if self.ties_joints:
            return super().link_wrenches(q, qd)
        return self.wrenches.of_packed(q, self._run(LINK_WRENCHES, q, qd))

    def share_variances(
        self, q: Numbers, qd: Numbers, qdd: Numbers, factors: ArrayLike
    ) -> Sequence[Numbers] | None:
        """Return the variances of packed values by uncertain bodies, (S, count) each."""
        motion = cast(Arrays, (q, qd, qdd))
        told = np.ascontiguousarray(factors, motion[0].dtype)
        return self.calls.run(SHARE_VARIANCES, motion, told=[told])

    def motion_variances(
        self, motion: Sequence[Numbers], roots: ArrayLike, names: Sequence[str]
    ) -> Mapping[str, Numbers] | None:
        """Return variances by uncertain motion by name, (entries, S) each."""
        return motion_variances(self.calls, cast(Arrays, motion), np.asarray(roots), names)

    def _run(self, call: str, *motion: Numbers) -> Arrays:
        return self.calls.run(call, cast(Arrays, motion))

    def _values(self, q: Numbers) -> Mapping[str, Numbers]:
        return self.calls.values(cast(NumberType, q.dtype))
