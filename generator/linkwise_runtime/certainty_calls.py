"""Calls on how certain answers are: what joint torques determine, and what errors of bodies do to shares."""

from collections.abc import Mapping, Sequence
from typing import Any, cast

from numpy.typing import ArrayLike

from .arrays.numpy_backend import NumpyBackend
from .certainty.identifiability import Identifiability, identifiability
from .certainty.share_bounds import ShareBounds, share_bounds
from .certainty.uncertain_bodies import UncertainBodies
from .certainty.uncertain_shares import uncertainty
from .interface import Array, array_of
from .motion_calls import MotionCalls
from .rule.calls import RigidRule
from .rule.joint_tree import Bodies
from .share_uncertainty import Uncertainty


class CertaintyCalls(MotionCalls):
    """Calls on certainty; arguments and answers are as `Dynamics` says."""

    def uncertainty(
        self,
        q: Array,
        qd: Array,
        qdd: Array,
        bodies: UncertainBodies | None = None,
        motion: ArrayLike | None = None,
    ) -> Uncertainty[Array]:
        """Return standard deviations of shares, of their sums and powers, by uncertain bodies and motion.

        bodies: standard deviations of what links carry, or any covariance of it, an `UncertainBodies`
        motion: covariance of q, qd and qdd, one after the other, (3 n, 3 n), or of each sample
        (..., 3 n, 3 n); it is independent of the bodies

        Shares are linear in the links' inertial parameters, and the covariance of these is worked out
        exactly; lengths, the places of joints, count to first order, by exact derivatives. Deviations are
        about the shares' means; where centres are uncertain these differ from the shares of the robot's own
        bodies, by what the mean of the inertia is more. Motion counts by `divided_differences`, to second
        order along each direction of its covariance, and products, torques by cause and powers, by the
        variances of both factors, see `product_moments`. Axes of joints, springs, damping, friction, armature
        and gravity count as certain. Raises ValueError, which names the
        link, for deviations and covariances that cannot be, where nothing is uncertain, and as `regressor`
        does.
        """
        found: Uncertainty[Array] = uncertainty(self, q, qd, qdd, bodies, motion)
        return found

    def identifiability(self, measured: Sequence[int | str] | None = None) -> Identifiability:
        """Return which shares follow from joint torques alone, and which lean on the file's masses.

        Many bodies have the same joint torques at every motion: a share follows from these if it has one
        value for all such bodies, which the rank of regressors at random motions tells. Springs, damping,
        friction and armature are taken to be known. Where joints are tied, torques and shares are those of
        the independent joints, as in `constraints.propagation`. Printed, the answer is a table.

        measured: joints whose torques are measured, by name or number; unless given, all that something
        drives: of a floating base none

        Raises ValueError for links given by energies, on the back end autograd, for parameters or bodies with
        samples, and for joints that are not there.
        """
        return identifiability(cast(Any, self), self._on_numpy, measured)

    def share_bounds(
        self,
        q: Array,
        qd: Array,
        qdd: Array,
        masses: float | Mapping[int | str, Any] | None = None,
        measured: Sequence[int | str] | None = None,
        shares: str | Sequence[str] = "torque",
        joints: Sequence[int | str] | None = None,
    ) -> ShareBounds:
        """Return the least and greatest value of each share over all bodies with the same joint torques.

        The bodies are all that could exist, with pseudo-inertias that are positive semidefinite, whose
        torques on the measured joints are those of this robot's at every motion; no link is above ten times
        the robot's mass and reach, see `certainty.feasible_bodies`. Each end is proved by the dual of its
        semidefinite program, whose `gap` is told, and `bodies` of the answer has those at an end.

        q, qd, qdd: one motion, (n,); of joints that are tied, a closed position and the motion of the
        independent ones
        masses: limits of masses: a part of every claimed one, 0.1 for 10 % less or more, or by link such a
        part, or (least, greatest) in kg
        measured: as in `identifiability`
        shares: "torque" (tau_ij), "acceleration", "velocity", "gravity" or "reactions", the components of
        what joints of the tree bear through each link, or several of them
        joints: loaded joints whose shares are wanted, all unless given; each share is two programs

        Needs Clarabel and SciPy, and raises ImportError without. Raises as `identifiability` does, and
        ValueError for several samples, limits of masses that no bodies keep, and links that could not exist.
        """
        motion = {"q": q, "qd": qd, "qdd": qdd}
        return share_bounds(cast(Any, self), self._on_numpy, motion, masses, measured, shares, joints)

    def _on_numpy(self, bodies: Bodies[Any] | None) -> Any:
        """Return this robot of rigid links on NumPy, with bodies in place of its own."""
        tree = self.backend.tree
        assert tree is not None  # as `LinearRobot.of` has seen
        values = {name: array_of(cast(Any, value)) for name, value in self.backend.parameters.items()}
        backend = NumpyBackend(self.structure, None, values, RigidRule(tree), "rule", bodies)
        return type(self)(self.structure, backend, self._load, self._asked)
