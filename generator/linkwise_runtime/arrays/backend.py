"""Base of the back ends: answers made of their packed values, the tree's numbers, and the choice of a kernel.

Kernels are straight closed forms, or the vectorised rule. Closed forms need the fewest additions and
multiplications, one array operation each: hundreds to thousands, whose calls cost more than their work unless
the batch is large. The rule needs more of them in a hundred or so array operations, on spatial matrices for
few samples, and with samples innermost for many. Which one is faster depends on the operations of the closed
forms and on the batch; `tests/benchmarks/kernel_crossing.py` measures it and prints the tables that the back
ends keep.
"""

import copy
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import cached_property
from typing import ClassVar, NamedTuple

import numpy as np

from ..answers.answers import Answers
from ..answers.packed import PackedBackend, TorqueOfOne
from ..arguments import NOTHING, Beside, as_array, shape_of
from ..interface import ClosedForms, Numbers
from ..kinematics.frame_answers import FrameAnswers
from ..kinematics.link_wrenches import CauseWrenches
from ..kinematics.wrench_answers import WrenchAnswers
from ..rule.calls import RigidRule
from ..rule.joint_tree import Bodies, JointTree
from ..rule.tree_arrays import TreeArrays, checked_bodies, given_numbers
from ..structure import Structure

Rows = tuple[tuple[int, int], ...]
"""(size of a robot, largest batch for which something is faster), by rising sizes."""

KERNELS = ("auto", "straight", "rule")


class ArrayBackend(PackedBackend):
    """Base of the back ends, each of which is a `PackedBackend` that computes with one library."""

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
        """True if the robot's file ties joints, or constraints were written with its links."""
        return self.structure.written is not None or (self.tree is not None and self.tree.tied)

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

    @cached_property
    def wrenches(self) -> WrenchAnswers:
        """Answers of the wrenches that joints bear, for motion that has been read; raises as `frames`."""
        return WrenchAnswers(self.frames)

    def link_wrenches(self, q: Numbers, qd: Numbers) -> CauseWrenches:
        """Return the wrenches of links by cause, (..., N, X, 6), before they are moved to any joint.

        Raises as `frames`.
        """
        return self.wrenches.of_links(q, qd)

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

    def separate(self) -> "ArrayBackend":
        """Return a copy whose parameters may be set by `set_parameters`, while this one keeps its own."""
        made = copy.copy(self)
        for kept in ("answers", "frames", "wrenches", "on_torch"):
            vars(made).pop(kept, None)
        made.parameters = dict(self.parameters)
        return made

    def set_parameters(self, values: Mapping[str, object]) -> None:
        """Give run-time parameters of a separate copy these values."""
        raise NotImplementedError

    def energies(self, q: Numbers, qd: Numbers) -> Sequence[Numbers]:
        """Return the kinetic and potential energies of the links in J, (..., N) each."""
        if self.rule:
            return self.rule.energies(self, (q, qd), self._values(q), self._bodies(q))
        values = self._energy_columns(q, qd)
        return values[..., 0::3], values[..., 1::3]

    def power_beside(self, q: Numbers, qd: Numbers) -> Numbers:
        """Return R_j, the power that links written by hand get otherwise than from joints, in W, (..., N)."""
        return self._energy_columns(q, qd)[..., 2::3]

    def _energy_columns(self, q: Numbers, qd: Numbers) -> Numbers:
        """Return K, P and R of the links, one after the other, (..., 3 N), from closed forms."""
        raise NotImplementedError

    def evaluated(
        self, function: Callable[..., Sequence[object]], motion: Sequence[Numbers], count: int
    ) -> Numbers:
        """Return what a closed form returns of namespace, motion (..., n) and parameters, (..., count)."""
        raise NotImplementedError

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


def largest_batch(rows: Rows, size: int) -> int:
    """Return the largest batch for a robot of a size, from the last row not above it; 0 below the first."""
    return next((most for least, most in reversed(rows) if least <= size), 0)


class Crossing(NamedTuple):
    """Range in which the rule is faster than closed forms, by the number of operations of these."""

    alone: int
    """Number of operations from which on the rule is faster for one sample of shape (n,): closed forms then
    compute with numbers, not arrays."""
    batches: Rows

    def rule_is_quicker(self, operations: int, batch: tuple[int, ...]) -> bool:
        """Return whether the rule is faster for so many operations and samples of shape `batch`."""
        if not batch:
            return operations >= self.alone
        return math.prod(batch) <= largest_batch(self.batches, operations)


def known_kernel(kernel: str, straight: bool, rule: bool, bodies: bool) -> str:
    """Return the kernel to use, auto where both remain; raise ValueError for one that cannot be used.

    straight, rule: whether the package has closed forms and the rule; bodies: whether bodies are given
    """
    if kernel not in KERNELS:
        raise ValueError(f"no kernel {kernel!r}; choose one of {', '.join(KERNELS)}")
    if bodies and not rule:
        raise ValueError("this package is of energies, which have no bodies; leave bodies out")
    if bodies and kernel == "straight":
        raise ValueError("closed forms hold the package's own bodies; take kernel='rule' with bodies")
    if kernel == "straight" and not straight:
        raise ValueError(
            "this package has no closed forms; take kernel='rule', or generate it with --kernel straight"
        )
    if kernel == "rule" and not rule:
        raise ValueError("this package is of energies, which have closed forms alone; take kernel='straight'")
    if bodies or not straight:
        return "rule"
    return kernel if rule else "straight"


def refuse_choice(backend: str, kernel: str, bodies: object) -> None:
    """Raise ValueError where a back end with one way to compute is asked for another."""
    if kernel != "auto":
        raise ValueError(f"{backend} has no kernels to choose from; leave kernel out, or load numpy or torch")
    if bodies is not None:
        raise ValueError(f"{backend} computes with the package's own bodies; load numpy or torch with bodies")


def refuse_learning(backend: str, requires_grad: object) -> None:
    """Raise ValueError where a back end without torch modules is asked for nn.Parameters."""
    if not isinstance(requires_grad, bool) or requires_grad:
        raise ValueError(
            f"{backend} has no torch modules; load autograd with requires_grad, or torch with tensors that "
            "require a gradient as parameters or bodies"
        )


def operations(links: Sequence[ClosedForms]) -> Mapping[str, int]:
    """Return the number of operations of each call of the closed forms."""
    calls = ("decomposition", "torque", "position_gradient")
    return {call: sum(link.OPERATIONS[call] for link in links) for call in calls}
