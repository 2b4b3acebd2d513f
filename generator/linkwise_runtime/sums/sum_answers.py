"""The calls that sum over the links, behind the face of `Dynamics`: motion is checked, answers are placed."""

from collections.abc import Sequence
from typing import Any

from ..answers import KINDS, MOTION, Answers
from ..interface import Backend
from ..structure import Structure
from .namespace import side_by_side
from .summed import Summed

GIVEN = dict.fromkeys(("forward_dynamics", "forward_dynamics_of_links"), ("q", "qd", "tau"))
"""Names of the arguments of calls that are not given q, qd and qdd."""


class SumAnswers(Answers):
    """The calls of a back end, its sums too; arguments as `Dynamics` says."""

    def __init__(
        self, structure: Structure, backend: Backend[Any], check_finite: bool, composed: Any = None
    ) -> None:
        super().__init__(structure, backend, check_finite, composed)
        self._sums = Summed(structure, backend, self._parts)

    def mass_matrix(self, q: Any, by_link: bool, out: Any = None) -> Any:
        """See `Dynamics.mass_matrix`."""
        return self._summed(_named("mass_matrix", by_link), (q,), out)

    def coriolis_matrix(self, q: Any, qd: Any, by_link: bool, out: Any = None) -> Any:
        """See `Dynamics.coriolis_matrix`."""
        return self._summed(_named("coriolis_matrix", by_link), (q, qd), out)

    def gravity_torque(self, q: Any, by_link: bool, out: Any = None) -> Any:
        """See `Dynamics.gravity_torque`."""
        return self._summed(_named("gravity_torque", by_link), (q,), out)

    def forward_dynamics(self, q: Any, qd: Any, tau: Any, passive: bool, out: Any = None) -> Any:
        """See `Dynamics.forward_dynamics`."""
        call = "forward_dynamics" if passive else "forward_dynamics_of_links"
        return self._summed(call, (q, qd, tau), out)

    def energy(self, q: Any, qd: Any, out: Any = None) -> Any:
        """See `Dynamics.energy`."""
        return self._summed("energy", (q, qd), out)

    def power(self, q: Any, qd: Any, qdd: Any, out: Any = None) -> Any:
        """See `Dynamics.power`."""
        return self._summed("power", (q, qd, qdd), out)

    def christoffel(self, q: Any, by_link: bool, out: Any = None) -> Any:
        """See `Dynamics.christoffel`."""
        return self._summed(_named("christoffel", by_link), (q,), out)

    def _parts(self, call: str, motion: Sequence[Any]) -> Sequence[Any]:
        """Results of a call that sums are composed of, for motion that has been looked at."""
        values: Sequence[Any] = self._computed(call, motion)
        return values

    def _summed(self, call: str, given: Sequence[Any], out: Any) -> Any:
        """Answer to the arguments of a call as they were given."""
        names, kind = GIVEN.get(call, MOTION), KINDS.get(call)
        motion = self._motion(given, names)
        into = self._accepted(call, motion, out, names)
        values = getattr(self._sums, call)(*motion)
        if into is None:
            values = [side_by_side(value) for value in values]
            return kind(*values) if kind else values[0]
        for place, value in zip(into, values, strict=True):
            place[...] = value
        return kind(*out) if kind else out


def _named(call: str, by_link: bool) -> str:
    return f"{call}_by_link" if by_link else call
