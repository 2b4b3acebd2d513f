"""Motion that ties leave a robot: qd = G yd of the independent coordinates y, qdd = G ydd + dG/dt yd.

Virtual work gives the equations of the coordinates y from those of the joints: G^T times these, in which the
forces of the ties drop out, as A G = 0. Without ties G is the unit matrix, which nothing multiplies by.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

from ..arrays.backend import ArrayBackend
from ..constraints.closed_places import ClosedPlace, independent_torque, times
from ..constraints.robot_constraints import Constraints
from ..interface import Numbers


class Freedom(NamedTuple):
    """Coordinates y at one state or at many, and how the joints move with them."""

    names: Sequence[str]
    """Names of the m coordinates y."""
    qd: Numbers
    """Velocities of all joints, (..., n), in which the dependent ones follow."""
    place: ClosedPlace | None
    """Closed position, and how joints follow there; None where all are free."""

    def projected(self, forces: Numbers) -> Numbers:
        """Return G^T F (..., m, X), for columns of forces on joints (..., n, X)."""
        return forces if self.place is None else independent_torque(self.place.found, forces)

    def moved(self, columns: Numbers) -> Numbers:
        """Return G Y (..., n, X), for columns of motions (..., m, X)."""
        moved: Numbers = columns if self.place is None else self.place.found.map @ columns
        return moved

    def columns(self, rows: Numbers) -> Numbers:
        """Return J G (..., r, m), for rows over the joints (..., r, n)."""
        mapped: Numbers = rows if self.place is None else rows @ self.place.found.map
        return mapped

    def inner(self, matrix: Numbers) -> Numbers:
        """Return G^T M G (..., m, m), for matrices (..., n, n)."""
        return self.projected(self.columns(matrix))

    def beside(self, wanted: Numbers | None) -> tuple[Numbers | None, Numbers | None]:
        """Return an acceleration that ties allow, and how far it is from the wanted one, (..., n) each.

        Its independent joints have the wanted acceleration. None stands for zeros.
        """
        if self.place is None:
            return wanted, None
        own = self.place.bias(self.qd)
        if wanted is None:
            return own, own
        allowed = self.place.velocity(self.place.own(wanted)) + own
        return allowed, allowed - wanted

    def rates(self, motions: Numbers) -> Numbers | None:
        """Return dG/dt Y (..., n, X), for motions G Y (..., n, X); None where G stays as it is."""
        if self.place is None:
            return None
        rate: Numbers = self.place.map_rate(self.qd) @ self.place.found.columns.own(motions, -2)
        return rate


def freedom_of(
    backend: ArrayBackend, constraints: Constraints[Any] | None, q: Numbers, qd: Numbers
) -> Freedom:
    """Return how joints move at q (..., n), at which ties close; of qd the independent joints count."""
    if constraints is None:
        return Freedom(backend.structure.joint_names, qd, None)
    place = constraints.ties.place(backend, q)
    return Freedom(constraints.independent, times(place.found.map, place.own(qd)), place)
