"""Base of the back ends: answers made of their packed values, and the numbers of the tree of joints."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import ClassVar

import numpy as np

from ..answers.answers import Answers
from ..arguments import NOTHING, Beside, as_array, shape_of
from ..interface import ClosedForms, Numbers
from ..kinematics.frame_answers import FrameAnswers
from ..packed_engine import PackedEngine, TorqueOfOne
from ..rule.joint_tree import Bodies, JointTree
from ..rule.rule_calls import RigidRule
from ..rule.tree_arrays import TreeArrays, checked_bodies, given_numbers
from ..structure import Structure
from .array_kernels import known_kernel, operations


class ArrayBackend(PackedEngine):
    """Base of the back ends, each of which is a `PackedEngine` that computes with one library."""

    takes_tensors: ClassVar[bool]
    """True if the back end computes with torch tensors."""
    face: ClassVar[type | None] = None
    """Class of the robots that compute with this back end; None for `Dynamics`."""
    direct: Mapping[str, Callable[..., object]] = {}
    """Calls by name that are faster than those of the table; their first argument is a robot, and they accept
    arrays alone."""
    at_once: Callable[[str, Sequence[object]], Sequence[Numbers] | None] | None = None
    """Function that returns the results of a row for what is plainly one sample, before it is read, or None
    where the arguments have to be read."""
    threads_set: int | None = None
    """Number of threads that was set; None where none was."""
    parameters: Mapping[str, float | Numbers]
    """Values of the run-time parameters by name."""
    bodies: Bodies[Numbers] | None
    """Bodies in place of the tree's; None for the tree's own."""

    def __init__(
        self,
        structure: Structure,
        links: Sequence[ClosedForms] | None,
        rule: RigidRule | None = None,
        kernel: str = "auto",
        bodies: object = None,
        reads: Callable[[str, object], Numbers] = as_array,
        tree: JointTree | None = None,
    ) -> None:
        """Set up the back end with closed forms `links`, the vectorised `rule`, or both.

        bodies: in place of the tree's; reads: makes numbers of them; tree: that of the frames, where there is
        no rule

        Raises ValueError for a kernel that cannot be used, and as `checked_bodies` does.
        """
        self.structure = structure
        self.links = links or ()
        self.operations = operations(links) if links and rule else {}
        self.rule, self.regresses = rule, rule is not None
        self.tree = tree or (rule.tree if rule else None)
        self.kernel = known_kernel(kernel, links is not None, rule is not None, bodies is not None)
        self.bodies: Bodies[Numbers] | None = None
        if bodies is not None:
            self.bodies = checked_bodies(bodies, structure.N, reads)

    @property
    def threads(self) -> int:
        """Number of threads that a large batch may use; AttributeError where the library has its own."""
        raise AttributeError(f"{self.name} has no threads of its own; native has")

    @threads.setter
    def threads(self, count: int) -> None:
        raise AttributeError(f"{self.name} has no threads of its own to set; native has")

    @property
    def samples(self) -> tuple[int, ...]:
        """Shape of the samples that have a parameter or a body each; () where all samples share them."""
        shapes = [shape_of(value) for value in self.parameters.values()]
        if self.bodies is not None:
            shapes += [shape_of(a)[: -1 - own] for own, a in enumerate(self.bodies)]
        try:
            return np.broadcast_shapes(*shapes)
        except ValueError:  # which the first call reports by name
            return max(shapes, key=len)

    @property
    def ties_joints(self) -> bool:
        """True if the robot's file ties joints."""
        return self.tree is not None and self.tree.tied

    @cached_property
    def answers(self) -> Answers:
        """Answers of the table's rows, for motion that has been read."""
        return Answers(self)

    @cached_property
    def frames(self) -> FrameAnswers:
        """Answers of the calls on frames, for motion that has been read.

        Raises ValueError for links given by energies.
        """
        if self.tree is None:
            raise ValueError(
                f"the links of {self.structure.name} are energies, which do not say where anything is; "
                "kinematics is there for rigid links"
            )
        return FrameAnswers(self, self.tree, self.tree_numbers)

    def read(
        self, named: Mapping[str, object], n: int, beside: Mapping[str, Beside] = NOTHING
    ) -> tuple["ArrayBackend", Sequence[Numbers]]:
        """Return this back end, which computes, and `arrays` as it computes with them."""
        return self, self.arrays(named, n, beside)

    def arrays(
        self, named: Mapping[str, object], n: int, beside: Mapping[str, Beside] = NOTHING
    ) -> Sequence[Numbers]:
        """Return the motion (..., n), then what is beside it, checked and in one shape of samples.

        Errors name the argument.
        """
        raise NotImplementedError

    def read_beside_motion(self) -> Iterable[object]:
        """Return the arrays or tensors, beside the motion, that results depend on."""
        return self.parameters.values()

    def controller(self, joints: object, frame: object) -> TorqueOfOne | None:
        """Return functions for one sample, for targets of joints and of a frame or None; None without."""
        return None

    def module(self, robot: object, call: str, fixed: Mapping[str, object]) -> object:
        """Return one call of a robot on this back end as a torch module; raise TypeError if it has none."""
        raise TypeError(f"{self.name} has no torch modules; load torch or autograd")

    def tree_numbers(self, own: tuple[TreeArrays, Numbers], q: Numbers) -> TreeArrays:
        """Return the tree's numbers for the parameters and the bodies; see `given_numbers`."""
        assert self.tree is not None  # `frames` has checked it
        return given_numbers(self.xp, self.tree, own, self._values(q), self._bodies(q), tuple(q.shape[:-1]))

    def _values(self, q: Numbers) -> Mapping[str, Numbers]:
        """Return the values of the run-time parameters, to compute with `q`."""
        raise NotImplementedError

    def _bodies(self, q: Numbers) -> Bodies[Numbers] | None:
        """Return the bodies in place of the tree's, to compute with `q`; None for its own."""
        raise NotImplementedError
