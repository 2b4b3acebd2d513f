"""The calls of `Dynamics` for control: controllers of a partial impedance, and the natural one."""

from collections.abc import Iterable
from typing import Any

from .controllers import Cancellation, FrameImpedance, Natural, PartialImpedance
from .interface import Array
from .quantities import NaturalImpedance


class ControllerCalls:
    """What a robot's impedance is, and controllers that give it another."""

    backend: Any

    def natural_impedance(self, q: Array, qd: Array, qdd: Array) -> NaturalImpedance[Array]:
        """How each tau_ij changes with the motion of k: c2_ijk, 2 c1_ijk - h1_ijk and c0_ijk, (..., n, N, n).

        d(tau_ij) = sum_k c2_ijk d(qdd_k) + (2 c1_ijk - h1_ijk) d(qd_k) + c0_ijk d(q_k), h1 being the part of
        c1 that comes of energies linear in the velocities.
        """
        answer: NaturalImpedance[Array] = self.backend.controls(self).natural(q, qd, qdd)
        return answer

    def partial_impedance(
        self,
        inertia: Any = Natural(),  # noqa: B008 - a tuple of numbers
        damping: Any = Natural(),  # noqa: B008
        stiffness: Any = 0.0,
        frame: FrameImpedance | None = None,
        passive: bool = True,
        friction_width: float | None = None,
    ) -> PartialImpedance[Array]:
        """A controller under which shares of inertia, damping and stiffness are as asked.

        inertia, damping, stiffness: targets, each one of
            Natural(scale, plus)            c2_ijk or c1_ijk as they are, or scaled by alpha_ij, and more
            {(joint, link, coordinate): x}  these entries in place of the natural ones, by name or number
            (n, N, n)                       all entries
            (n, n), (n,) or a number        their sum over the links; a diagonal; the same at every joint
        in kg m^2, N m s/rad and N m/rad, or as prismatic joints have them. Stiffness has no natural part:
        positions meet gravity, which is compensated.
        frame: what a frame is to feel like; the joints' targets are then for what it leaves free
        passive: whether the joints' own springs and damping are compensated, and their armature kept as part
        of the inertia, beside the links; else they are as if not there, which is right only where the
        description has none. An inertia that is given as a sum is the whole, armature included.
        friction_width: None, and the joints' Coulomb friction is not compensated: it jumps at rest, and so
        would torques, with the noise of a sensor. Else a velocity w in rad/s or m/s: friction tanh(qd / w)
        is, 0.76 of the friction at w and 0.999 of it at 3.8 w.

        Tensors among the targets are taken anew at each call, so that gains can be learned, and are refused
        there where they are positive no more.

        Raises ValueError for names or shapes that are not there, and for a target that is not positive: an
        inertia that is not positive definite or not symmetric, a stiffness or a damping that gives energy
        away; and for robots with ties, whose joints are not free.
        """
        answers = self.backend.controls(self)
        return PartialImpedance(
            answers.impedance(inertia, damping, stiffness, frame, passive, friction_width)
        )

    def cancel(
        self, entries: Iterable[Any], passive: bool = True, friction_width: float | None = None
    ) -> Cancellation[Array]:
        """A controller that cancels chosen motion propagation torques and no others, gravity apart.

        entries: (joint, link, coordinate, order): c2_ijk qdd_k for the order 2 and c1_ijk qd_k for 1 (closing
        convention), by name or number; None in a place is all that there are. "What link 3's motion does to
        the root": {("joint1", "link3", None, None)}.
        passive, friction_width: as in `partial_impedance`

        Raises ValueError for what is not there, such as a joint that is not on the path of the link, or what
        is named twice. Calls raise it where what is left has no regular mass matrix, and warn where rounding
        leaves fewer than half of the digits of what follows from it, unless they are given qdd.
        """
        answers, named = self.backend.controls(self).cancellation(entries, passive, friction_width)
        return Cancellation(answers, named)
