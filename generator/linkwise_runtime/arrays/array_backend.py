"""What back ends of arrays and of tensors do alike: they make the calls, and give a tree's numbers."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any, ClassVar

from ..constraints.chosen_constraints import ChosenConstraints
from ..constraints.constraint_answers import ConstraintAnswers, constraint_answers
from ..constraints.tie_rows import TieRows
from ..control.controls import Controls
from ..induced.induced_answers import InducedAnswers
from ..kinematics.kinematic_answers import KinematicAnswers
from ..rule.joint_tree import JointTree
from ..rule.tree_arrays import TreeArrays, given_numbers
from ..simulation.simulation_answers import simulated
from ..structure import Structure
from ..sums.sum_answers import SumAnswers


class ArrayBackend:
    """Base of the back ends that answer in Python; `xp` is the array namespace."""

    name: ClassVar[str]
    xp: ClassVar[Any]
    structure: Structure
    tree: JointTree | None
    """Where frames are; None for links of energies."""

    def answers(self, check_finite: bool) -> SumAnswers:
        """The calls of `Dynamics`."""
        own: Any = self
        return SumAnswers(self.structure, own, check_finite)

    def kinematics(
        self, check_finite: bool, read_beside_motion: Callable[[], Iterable[Any]]
    ) -> KinematicAnswers:
        """The calls of `Kinematics`."""
        return KinematicAnswers(self.structure, self, check_finite, read_beside_motion)

    def induced(self, robot: Any) -> InducedAnswers:
        """The calls for induced accelerations of a robot on this back end."""
        return InducedAnswers(robot)

    def controls(self, robot: Any) -> Controls:
        """What makes controllers of a robot on this back end."""
        return Controls(robot)

    def constraints(
        self, robot: Any, independent: Any, contacts: Any, at: Any, tolerance: Any
    ) -> ConstraintAnswers:
        """The calls of `Constraints` on a robot with this back end."""

        def rows(chosen: ChosenConstraints) -> TieRows:
            return self.tie_rows(chosen, robot.check_finite, robot._answers.read_beside_motion)

        return constraint_answers(robot, independent, contacts, at, tolerance, rows)

    def tie_rows(
        self,
        chosen: ChosenConstraints,
        check_finite: bool,
        read_beside_motion: Callable[[], Iterable[Any]],
    ) -> TieRows:
        """Rows of ties and contacts."""
        return TieRows(self.structure, self, check_finite, read_beside_motion, chosen)

    def simulated(self, robot: Any, *given: Any) -> Any:
        """The motion of a robot on this back end over time; see `MotionCalls.simulate`."""
        return simulated(robot, *given)

    def module(self, robot: Any, call: str, fixed: Mapping[str, Any]) -> Any:
        """One call of a robot on this back end as a torch module; raises TypeError without any."""
        raise TypeError(f"{self.name} has no torch modules; load torch or autograd")

    def side(self, like: Any) -> Any:
        """What computes with `like`, an array or a tensor."""
        return self

    def tree_numbers(self, own: tuple[TreeArrays, Any], q: Any) -> TreeArrays:
        """The tree's numbers for the parameters and the bodies; see `given_numbers`."""
        assert self.tree is not None  # KinematicAnswers has seen to it
        p, bodies = self._values(q), self._bodies(q)
        return given_numbers(self.xp, self.tree, own, p, bodies, tuple(q.shape[:-1]))

    def _values(self, q: Any) -> dict[str, Any]:
        """Values of the run-time parameters, to compute with `q`."""
        raise NotImplementedError

    def _bodies(self, q: Any) -> Any:
        """Bodies in place of the tree's, to compute with `q`; None for its own."""
        raise NotImplementedError
