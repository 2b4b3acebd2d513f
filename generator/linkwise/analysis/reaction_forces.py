"""Forces of ties and contacts, split by link, by passive torques of the joints, and by load.

Contacts take their part first, by the equations of the joints that nothing drives; ties carry the rest,
including what the contacts put on the dependent joints.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from linkwise.analysis.contacts.ground import Standing
from linkwise.analysis.contacts.times import ContactTimes
from linkwise.analysis.loads.placed import PlacedLoad
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.result_quantities import FORCE_OF, FORCES, GROUND, PASSIVE
from linkwise.analysis.result_rows import ResultRows
from linkwise.arrays import Array

Motion = tuple[Array, Array, Array]
"""q, q̇ and q̈, each (S, n)."""


@dataclass(frozen=True)
class ReactionForces:
    """Fills the columns of forces, and those of contacts."""

    robot: OpenedRobot
    loads: tuple[PlacedLoad, ...]
    times: ContactTimes | None

    def fill(
        self,
        out: Array,
        rows: ResultRows,
        standing: Standing | None,
        time: Array,
        motion: Motion,
        partial: Array,
    ) -> None:
        """Fill the rows of forces in `out` (rows, S).

        partial: tau_ij (S, n, N), of which contacts carry a part
        """
        if not rows.named.intersection((*FORCES, *GROUND)):
            return
        by_link = self._by_link(standing, motion, partial)
        beside = self._beside(standing, time, motion)
        rows.put(out, "force", by_link.sum(-1) + beside.sum(-1))
        rows.put(out, "force_link", np.swapaxes(by_link, 1, 2))
        for at, share in enumerate(PASSIVE):
            rows.put(out, FORCE_OF[share], beside[..., at])
        rows.put(out, "force_load", beside[..., len(PASSIVE) :])
        if standing is not None:
            self._fill_ground(out, rows, standing, time, motion, by_link)

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

    def _fill_ground(
        self,
        out: Array,
        rows: ResultRows,
        standing: Standing,
        time: Array,
        motion: Motion,
        by_link: Array,
    ) -> None:
        """Fill the rows of contacts: shares, power fed into links by slip, slip velocities, measured forces.

        Joint torques by the measured forces are filled, too.
        """
        times, ground, own = self.times, self.robot.ground, self.robot.contact_rows
        assert times is not None
        (q, qd, _), model = motion, self.robot.model
        rows.put(out, "contact", times.shares(model, time, q))
        fed = standing.fed(qd, by_link[:, own], ground.owners, len(ground.names))
        rows.put(out, "power_contact", np.swapaxes(fed, 1, 2))
        slip, measured = np.zeros((2, len(q), own.stop))
        slip[:, own] = standing.slip(qd)
        wrenches = [times.wrench(c, model, time, q, place) for c, place in enumerate(ground.places(model, q))]
        for row, owner, part in zip(
            range(own.start, own.stop), ground.owners, ground.wrench_rows, strict=True
        ):
            if part is not None:
                measured[:, row] = wrenches[owner][:, part]
        rows.put(out, "slip", slip)
        rows.put(out, "force_measured", measured)
        asked = np.asarray(model.inverse_dynamics(*motion)) + times.torque(model, time, q)
        rows.put(out, "tau_as_loads", asked + self._torques(model, time, motion).sum(-1))
