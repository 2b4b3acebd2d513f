"""Forces of ties and contacts, split by link, by passive torques of the joints, and by load.

Contacts take their part first, by the equations of the joints that nothing drives; ties carry the rest,
including what the contacts put on the dependent joints.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.analysis.contacts.contact_times import ContactTimes
from linkwise.analysis.contacts.ground_contacts import Standing
from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.analysis.loads.placed_load import PlacedLoad
from linkwise.analysis.result_columns import Column
from linkwise.analysis.result_quantities import FORCE_OF, PASSIVE
from linkwise.package.load import Array

Motion = tuple[Array, Array, Array]
"""q, q̇ and q̈, each (S, n)."""


@dataclass(frozen=True)
class BorneForces:
    """Fills the columns of forces, and those of contacts."""

    robot: LoadedRobot
    loads: tuple[PlacedLoad, ...]
    times: ContactTimes | None

    def fill(
        self,
        out: Array,
        columns: Sequence[Column],
        standing: Standing | None,
        time: Array,
        motion: Motion,
        partial: Array,
    ) -> None:
        """Fill the force columns of `out` (columns, S).

        partial: tau_ij (S, n, N), of which contacts carry a part
        """
        if not self.robot.constraint_rows:
            return
        by_link = self._by_link(standing, motion, partial)
        beside = self._beside(standing, time, motion)
        own, loads = beside[..., : len(PASSIVE)], beside[..., len(PASSIVE) :]
        whole = by_link.sum(-1) + beside.sum(-1)
        place = {FORCE_OF[share]: at for at, share in enumerate(PASSIVE)}
        for column, values in zip(columns, out, strict=True):
            match column.quantity:
                case "force":
                    values[:] = whole[:, column.cause]
                case "force_link":
                    values[:] = by_link[:, column.cause, column.link]
                case "force_load":
                    values[:] = loads[:, column.cause, column.load]
                case quantity if quantity in place:
                    values[:] = own[:, column.cause, place[quantity]]
        if standing is not None:
            self._fill_ground(out, columns, standing, time, motion)
            self._fill_fed(out, columns, standing, motion[1], by_link)

    def _by_link(self, standing: Standing | None, motion: Motion, partial: Array) -> Array:
        """Return the constraint forces due to each link, (S, C, N)."""
        model: Any = self.robot.model
        tied = None if self.robot.constrained is None else model.forces(*motion)
        if standing is None:
            assert tied is not None
            return np.asarray(tied)
        return self._joined(motion[0], tied, standing, standing.reactions(partial))

    def _beside(self, standing: Standing | None, time: Array, motion: Motion) -> Array:
        """Return the constraint forces due to passive torques and loads, (S, C, X).

        X counts the joints' passive torques, in the order of PASSIVE, then the loads.
        """
        q, tied = motion[0], self.robot.constrained
        model: Any = self.robot.model
        given = self._torques(model if tied is None else tied.open, time, motion)
        of_ties = None if tied is None else tied.forces_of(q, given)
        if standing is None:
            assert of_ties is not None
            return of_ties
        if tied is not None:
            given = self._torques(model, time, motion)
        return self._joined(q, of_ties, standing, standing.reactions(given))

    def _joined(self, q: Array, of_ties: Array | None, standing: Standing, reactions: Array) -> Array:
        """Return the forces in the rows of ties, then of contacts, (S, C, X).

        Ties carry what contacts put on the dependent joints too.
        """
        tied = self.robot.constrained
        if tied is None or of_ties is None:
            return reactions
        given = tied.forces_of(q, standing.loads(reactions))
        return np.concatenate([of_ties - given, reactions], axis=1)

    def _torques(self, model: Any, time: Array, motion: Motion) -> Array:
        """Return the passive torques of the joints, then the torques of the loads, by a model, (S, n, X)."""
        q = motion[0]
        own = [np.asarray(a) + 0.0 * q for a in model.passive_torque(*motion)]
        return np.stack([*own, *(borne.torque(model, time, q) for borne in self.loads)], axis=-1)

    def _fill_fed(
        self, out: Array, columns: Sequence[Column], standing: Standing, qd: Array, by_link: Array
    ) -> None:
        """Fill the power that contacts feed into links as they slip."""
        ground = self.robot.contacts
        assert ground is not None
        own = by_link[:, len(self.robot.constraint_rows) - len(ground.rows) :]
        fed = standing.fed(qd, own, ground.owners, len(ground.names))
        for column, values in zip(columns, out, strict=True):
            if column.quantity == "power_contact":
                values[:] = fed[:, column.cause, column.link]

    def _fill_ground(
        self, out: Array, columns: Sequence[Column], standing: Standing, time: Array, motion: Motion
    ) -> None:
        """Fill shares, slip velocities and measured forces of contacts, and joint torques by these forces."""
        times, ground = self.times, self.robot.contacts
        assert times is not None
        assert ground is not None
        (q, qd, _), model = motion, self.robot.model
        first = len(self.robot.constraint_rows) - len(ground.rows)
        slip, shares = standing.slip(qd), times.shares(model, time, q)
        places = ground.places(model, q)
        measured = [times.wrench(c, model, time, q, place) for c, place in enumerate(places)]
        asked = np.asarray(model.inverse_dynamics(*motion)) + times.torque(model, time, q)
        asked = asked + self._torques(model, time, motion).sum(-1)
        for column, values in zip(columns, out, strict=True):
            match column.quantity:
                case "contact":
                    values[:] = shares[:, column.cause]
                case "slip":
                    values[:] = slip[:, (column.cause or 0) - first]
                case "force_measured":
                    row = (column.cause or 0) - first
                    values[:] = measured[ground.owners[row]][:, ground.wrench_rows[row]]
                case "tau_as_loads":
                    values[:] = asked[:, column.joint]
