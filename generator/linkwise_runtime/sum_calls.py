"""The calls of `Dynamics` that sum over the links, and names of joints and links as numbers."""

from collections.abc import Sequence
from typing import Any

from .interface import Array, Backend
from .quantities import Energy, Power
from .structure import Structure


class SumCalls:
    """What is known of a robot as a whole; with `by_link=True`, the share of each link j in it, on an axis j.

    Arguments, batches, `out` and errors are those of `Dynamics`.
    """

    structure: Structure
    backend: Backend[Any]
    _answers: Any

    def joint_index(self, joint: int | str) -> int:
        """Index i or k of a joint by number from 0 or by name; raises ValueError for what is neither."""
        return self.structure.joint_index(joint)

    def link_index(self, link: int | str) -> int:
        """Index j of a link by number from 0 or by name; raises ValueError for what is neither."""
        return self.structure.link_index(link)

    def mass_matrix(self, q: Array, by_link: bool = False, out: Array | None = None) -> Array:
        """M_ik = sum_j c2_ijk, shape (..., n, n); by link c2_ijk, (..., n, N, n).

        In kg m^2, kg m or kg, where none, one or both of i and k are prismatic.
        """
        mass: Array = self._answers.mass_matrix(q, by_link, out)
        return mass

    def coriolis_matrix(self, q: Array, qd: Array, by_link: bool = False, out: Array | None = None) -> Array:
        """C_ik = sum_j c1_ijk of the closing convention, shape (..., n, n); by link c1_ijk, (..., n, N, n).

        C qd is the velocity force. Of rigid links it is the matrix of Christoffel symbols: dM/dt - 2 C is
        skew-symmetric.
        """
        coriolis: Array = self._answers.coriolis_matrix(q, qd, by_link, out)
        return coriolis

    def gravity_torque(self, q: Array, by_link: bool = False, out: Array | None = None) -> Array:
        """g_i = sum_j g_ij, the torque of gravity and other potentials, (..., n); by link (..., n, N)."""
        gravity: Array = self._answers.gravity_torque(q, by_link, out)
        return gravity

    def forward_dynamics(
        self, q: Array, qd: Array, tau: Array, passive: bool = True, out: Array | None = None
    ) -> Array:
        """qdd of M qdd + C qd + g + p = tau, shape (..., n), in rad/s^2 or m/s^2; tau (..., n) in N m or N.

        p is the total of `passive_torque`, which has armature times qdd in it.

        passive: whether joints have their springs, damping, friction and armature; False leaves p away: tau
        is then for the links alone, and this the inverse of `inverse_dynamics`

        Raises ValueError for a robot with ties, whose joints move as `constraints.forward_dynamics` says, and
        for a singular mass matrix, with the sample and the joints that can move without moving any mass;
        inside torch.func and torch.compile, qdd is then not finite. Warns where rounding leaves fewer than
        half of the digits of M^-1, as near 90 degrees of a floating base's pitch, and how many are left.
        """
        tree = self.backend.tree
        if tree is not None and tree.tied:
            raise ValueError(
                f"the joints of {self.structure.name} are tied, which its open tree does not know; call "
                "constraints.forward_dynamics(q, qd, tau)"
            )
        qdd: Array = self._answers.forward_dynamics(q, qd, tau, passive, out)
        return qdd

    def energy(self, q: Array, qd: Array, out: Sequence[Array] | None = None) -> Energy[Array]:
        """Kinetic and potential energy of each link in J, (..., N) each.

        The potential energy of rigid links is zero at the world's origin; hand-written energies are as they
        were written.
        """
        answer: Energy[Array] = self._answers.energy(q, qd, out)
        return answer

    def power(self, q: Array, qd: Array, qdd: Array, out: Sequence[Array] | None = None) -> Power[Array]:
        """P_ij = tau_ij qd_i, the power in W that joint i sends into link j, by whose motion, of which order.

        Shapes (..., n, N, n) twice and (..., n, N); `.total` is P_ij. sum_i P_ij is the rate of link j's
        energy, sum_j P_ij what actuator i gives.
        """
        answer: Power[Array] = self._answers.power(q, qd, qdd, out)
        return answer

    def christoffel(self, q: Array, by_link: bool = False, out: Array | None = None) -> Array:
        """Gamma_ikl, the velocity share of every pair of motions, (..., n, n, n); by link (..., n, N, n, n).

        sum_kl Gamma_ikl qd_k qd_l is the velocity force: Gamma_ikk qd_k^2 comes of joint k's motion alone,
        (Gamma_ikl + Gamma_ilk) qd_k qd_l of the motions of k and l together. Symmetric in k and l. Terms of
        energies linear in the velocities, as on a moving base, are no part of it.
        """
        symbols: Array = self._answers.christoffel(q, by_link, out)
        return symbols
