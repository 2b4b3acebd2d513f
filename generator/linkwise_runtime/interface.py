"""What the parts of a package say to each other: arrays, closed forms, back ends."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    # A package that needs no torch is read without it; then tensors are Any.
    from torch import Tensor  # type: ignore[import-not-found, unused-ignore]

Array = TypeVar("Array", NDArray[np.float64], NDArray[np.float32], NDArray[Any], "Tensor")
"""NumPy array or torch tensor, of float32 or float64; answers are what the motion is, device included."""

Kind = TypeVar("Kind")

Entries = tuple[Any, ...]
"""Packed values one by one: each an array of the batch's shape (...), or a number that all samples share."""


class ClosedForms(Protocol):
    """forms/link_k.py: the closed forms of one link over its path, for arrays of the namespace `xp`.

    q, qd, qdd have shape (..., n); `p` maps names of parameters to values; entries are in the order of
    `Layout`.
    """

    OPERATIONS: Mapping[str, int]
    """Operations of each of the functions, sines and the like included: so many there are on arrays."""

    def decomposition(self, xp: Any, q: Any, qd: Any, qdd: Any, p: Mapping[str, Any]) -> tuple[Entries, ...]:
        """(c2, c1, g, tau), and h1 after them for a link whose energy has terms linear in the velocities."""

    def torque(self, xp: Any, q: Any, qd: Any, qdd: Any, p: Mapping[str, Any]) -> Entries:
        """tau_ij, by i."""

    def position_gradient(self, xp: Any, q: Any, qd: Any, qdd: Any, p: Mapping[str, Any]) -> Entries:
        """c0_ijk = d(tau_ij)/d(q_k), by i, then k."""


class EnergyForms(ClosedForms, Protocol):
    """Those of a link that is energies; the rule has the energies of rigid links."""

    def energy(self, xp: Any, q: Any, qd: Any, p: Mapping[str, Any]) -> Entries:
        """Kinetic and potential energy in J."""


class Backend(Protocol[Kind]):
    """What computes: packed values (..., count) in the order of `Layout`, and a few operations on arrays."""

    name: ClassVar[str]
    takes_tensors: ClassVar[bool]
    """Whether motion is given as torch tensors only."""
    examples: tuple[Any, ...]
    """Empty arrays of kinds that tables are made for in advance: no compiler traces how they are made."""
    face: ClassVar[Any]
    """Class of the robots that compute with it; None for `Dynamics`."""
    parameters: Any
    """Values of the run-time parameters by name."""
    rule: Any
    """The vectorised rule of rigid links, None without it."""
    tree: Any
    """Joints, links and frames of rigid links; None for energies."""

    def arrays(self, named: Mapping[str, Kind], n: int) -> Sequence[Kind]:
        """The motion, checked and broadcast to a common shape (..., n); errors name the argument."""

    def side(self, like: Kind) -> Any:
        """What computes with `like`, an array or a tensor: it has `constant`, and its namespace as `xp`."""

    def decomposition(self, q: Kind, qd: Kind, qdd: Kind) -> Sequence[Kind]:
        """c2, c1, g, tau, h1, each (..., count) in the order of `Layout`."""

    def torque(self, q: Kind, qd: Kind, qdd: Kind) -> Kind:
        """tau (..., count) in the order of `Layout.torque`."""

    def position_gradient(self, q: Kind, qd: Kind, qdd: Kind) -> Kind:
        """c0 (..., count) in the order of `Layout.velocity`."""

    def energies(self, q: Kind, qd: Kind) -> tuple[Kind, Kind]:
        """Kinetic and potential energies of the links in J, (..., N) each."""

    def regressor(self, q: Kind, qd: Kind, qdd: Kind) -> Kind:
        """Rows of 10 of tau in the order of `Layout.torque`, flat: (..., 10 count)."""

    def coefficient_regressors(self, q: Kind, qd: Kind, qdd: Kind) -> Sequence[Kind]:
        """Rows of 10 of c2, c1, g in the order of `Layout`, flat: (..., 10 count) each."""

    def answers(self, check_finite: bool) -> Any:
        """The calls of `Dynamics` on this back end: an `Answers`."""

    def kinematics(self, check_finite: bool, read_beside_motion: Callable[[], Iterable[Any]]) -> Any:
        """The calls of `Kinematics`, a `KinematicAnswers`; raises ValueError without a tree."""

    def induced(self, robot: Any) -> Any:
        """The calls for induced accelerations of a robot on this back end, an `InducedAnswers`."""

    def controls(self, robot: Any) -> Any:
        """What makes controllers of a robot on this back end, a `Controls`."""

    def constraints(self, robot: Any, independent: Any, contacts: Any, at: Any, tolerance: Any) -> Any:
        """The calls of `Constraints` on a robot with this back end; raises as `Dynamics.constrained` does."""

    def module(self, robot: Any, call: str, fixed: Mapping[str, Any]) -> Any:
        """One call of a robot on this back end as a torch module; raises as `Dynamics.module` does."""

    def simulated(self, robot: Any, *given: Any) -> Any:
        """The motion of a robot on this back end over time, a `Trajectory`."""

    def constant(self, values: NDArray[Any], like: Kind) -> Kind:
        """A table of numbers, to compute with `like`."""

    def index(self, values: NDArray[np.intp], like: Kind) -> Kind:
        """A table of positions, to take from `like`."""

    def weights(self, name: str, value: Any, like: Kind) -> Kind:
        """Real numbers in anything array-like, of the kind and dtype of `like`; errors name the argument."""

    def zeros(self, like: Kind, count: int) -> Kind:
        """Zeros of shape (..., count) for `like` of shape (..., m)."""

    def concatenate(self, parts: Iterable[Kind]) -> Kind:
        """The parts joined along the last axis."""
