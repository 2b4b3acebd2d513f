"""Compiled C on NumPy arrays and torch CPU tensors."""

import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from ..arguments import has_tensors
from ..arrays.numpy_backend import NumpyBackend
from ..constraints.chosen_constraints import ChosenConstraints
from ..control.controls import Controls
from ..interface import ClosedForms
from ..rule.rule_calls import RigidRule
from ..structure import Structure
from .native_answers import NativeAnswers
from .native_calls import NativeCalls, checked_threads
from .native_control import ControlCalls, NativeKinematics
from .native_impedance import NativeControlAnswers
from .native_ties import NativeTieRows

if TYPE_CHECKING:
    from .native_torch import TorchSide


class NativeBackend(NumpyBackend):
    """Arrays for arrays, tensors for tensors; each parameter is one number for all samples."""

    name: ClassVar = "native"
    takes_tensors: ClassVar = False

    def __init__(
        self,
        structure: Structure,
        sources: Path,
        links: Sequence[ClosedForms] | None,
        parameters: Mapping[str, Any],
        rule: RigidRule | None = None,
    ) -> None:
        """`sources` is the package's folder of C; `links` or `rule` serve torch, which differentiates them.

        Compiles at the first call for this package; raises RuntimeError where that cannot be.
        """
        super().__init__(structure, links, {}, rule)
        self.forms = links
        self.parameters = dict(parameters)
        self.calls = NativeCalls(structure, sources, parameters)
        self.control = ControlCalls(self.calls)
        self._torch_side: TorchSide | None = None
        if "torch" in sys.modules:
            self.examples = self.on_torch().examples

    @property
    def threads(self) -> int:
        """Threads that a large batch may use; as many as there are cores unless set."""
        return self.calls.threads

    @threads.setter
    def threads(self, count: int) -> None:
        """Raises TypeError or ValueError for what is not a whole number from 1 on."""
        self.calls.threads_set = checked_threads(count)

    @property
    def threads_set(self) -> int | None:
        """Threads that somebody has set; None where nobody has."""
        return self.calls.threads_set

    def arrays(self, named: Mapping[str, Any], n: int) -> Sequence[Any]:
        """The motion, checked and broadcast to a common shape (..., n); errors name the argument."""
        values = named.values()
        if {np.ndarray}.issuperset(map(type, values)) or not has_tensors(values):
            return super().arrays(named, n)
        return self.on_torch().arrays(named, n)

    def answers(self, check_finite: bool) -> NativeAnswers:
        """The calls of `Dynamics`: C writes the answers, but for tensors of which gradients are recorded."""
        control = None if self.tree is None else self.control
        return NativeAnswers(self, self.calls, self.on_torch, check_finite, control)

    def controls(self, robot: Any) -> Controls:
        """What makes controllers of a robot: C answers for one sample, arrays and tensors else."""
        return Controls(robot, partial(NativeControlAnswers, self.calls))

    def kinematics(
        self, check_finite: bool, read_beside_motion: Callable[[], Iterable[Any]]
    ) -> NativeKinematics:
        """The calls of `Kinematics`: C answers for one sample, arrays and tensors else."""
        return NativeKinematics(self.structure, self, check_finite, read_beside_motion, self.control)

    def tie_rows(
        self,
        chosen: ChosenConstraints,
        check_finite: bool,
        read_beside_motion: Callable[[], Iterable[Any]],
    ) -> NativeTieRows:
        """Rows of ties and contacts: C answers for their frames of one sample."""
        return NativeTieRows(self.structure, self, check_finite, read_beside_motion, chosen, self.control)

    def side(self, like: Any) -> Any:
        """What computes with `like`, an array or a tensor."""
        return self.on_torch() if has_tensors([like]) else self

    def decomposition(self, q: Any, qd: Any, qdd: Any) -> Sequence[Any]:
        """c2, c1, g, tau, h1, each (..., count) in the order of `Layout`."""
        if has_tensors([q]):
            return self.on_torch().decomposition(q, qd, qdd)
        return self.calls.run("packed", (q, qd, qdd))

    def torque(self, q: Any, qd: Any, qdd: Any) -> Any:
        """tau (..., count) in the order of `Layout.torque`."""
        if has_tensors([q]):
            return self.on_torch().torque(q, qd, qdd)
        return self.calls.run("packed_torque", (q, qd, qdd))[0]

    def position_gradient(self, q: Any, qd: Any, qdd: Any) -> Any:
        """c0 (..., count) in the order of `Layout.velocity`."""
        if has_tensors([q]):
            return self.on_torch().position_gradient(q, qd, qdd)
        return self.calls.run("packed_position_gradient", (q, qd, qdd))[0]

    def energies(self, q: Any, qd: Any) -> tuple[Any, Any]:
        """Kinetic and potential energies of the links in J, (..., N) each; C has none."""
        return self.on_torch().energies(q, qd) if has_tensors([q]) else super().energies(q, qd)

    def regressor(self, q: Any, qd: Any, qdd: Any) -> Any:
        """Rows of 10 of tau in the order of `Layout.torque`, flat: (..., 10 count)."""
        return self.on_torch().regressor(q, qd, qdd) if has_tensors([q]) else super().regressor(q, qd, qdd)

    def coefficient_regressors(self, q: Any, qd: Any, qdd: Any) -> Sequence[Any]:
        """Rows of 10 of c2, c1, g in the order of `Layout`, flat: (..., 10 count) each."""
        if has_tensors([q]):
            return self.on_torch().coefficient_regressors(q, qd, qdd)
        return super().coefficient_regressors(q, qd, qdd)

    def constant(self, values: NDArray[Any], like: Any) -> Any:
        """A table of numbers, to compute with `like`."""
        return (
            self.on_torch().constant(values, like) if has_tensors([like]) else super().constant(values, like)
        )

    def index(self, values: NDArray[np.intp], like: Any) -> Any:
        """A table of positions, to take from `like`."""
        return self.on_torch().index(values, like) if has_tensors([like]) else super().index(values, like)

    def weights(self, name: str, value: Any, like: Any) -> Any:
        """Real numbers in anything array-like, of the kind and dtype of `like`; errors name the argument."""
        return (
            self.on_torch().weights(name, value, like)
            if has_tensors([like])
            else super().weights(name, value, like)
        )

    def zeros(self, like: Any, count: int) -> Any:
        """Zeros of shape (..., count) for `like` of shape (..., m)."""
        return self.on_torch().zeros(like, count) if has_tensors([like]) else super().zeros(like, count)

    def concatenate(self, parts: Iterable[Any]) -> Any:
        """The parts joined along the last axis."""
        parts = list(parts)
        return self.on_torch().concatenate(parts) if has_tensors(parts) else super().concatenate(parts)

    def _values(self, q: Any) -> dict[str, Any]:
        return self.calls.values(q.dtype)

    def on_torch(self) -> "TorchSide":
        """What computes with tensors."""
        if self._torch_side is None:
            from .native_torch import TorchSide  # it needs torch, which arrays do without

            self._torch_side = TorchSide(self.calls, self.forms, self.rule)
        return self._torch_side
