"""The result of an analysis: named arrays, and the record of how they were made."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np
from linkwise_runtime.chosen_names import nearest_first

from linkwise.analysis.borne_joints import BorneJoint
from linkwise.analysis.certain_signs import CertainSigns
from linkwise.analysis.closed_motion import ClosedLog
from linkwise.analysis.contacts.times import ContactTimes
from linkwise.analysis.disk_rows import let_go
from linkwise.analysis.loads.placed import PlacedLoad
from linkwise.analysis.markers.followed import MarkerLog
from linkwise.analysis.net_causes import NET
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.phases import PlacedPhase
from linkwise.analysis.result_rows import Column, ResultRows
from linkwise.analysis.settings import Processing, Reading
from linkwise.analysis.whole_movement import WholeMovement, not_asked_for
from linkwise.arrays import Array, Index
from linkwise.errors import LinkwiseError
from linkwise.escape import listed, printable, short

PART_BYTES, LEAST = 4 << 20, 256
"""Approximate size in bytes of a part of a result, and its fewest samples."""


@dataclass(frozen=True, eq=False)
class AnalysisResult(WholeMovement):
    """Result of an analysis: S samples of every torque term, SI units; index order joint, link, cause.

    `values` (rows, S) holds every sample of what `rows` lists quantity by quantity, and `columns` by name, in
    memory or in a file behind it; terms that are identically 0 have no row. n joints, N links.
    """

    robot: OpenedRobot
    reading: Reading
    processing: Processing
    source: str
    """Name of the log."""
    rate: float
    """Sampling rate in Hz."""
    rows: ResultRows
    asked_columns: tuple[str, ...]
    """Columns that were asked for, as they were written."""
    told: Index
    """Numbers of the rows of a table of the result."""
    values: Array
    loads: tuple[PlacedLoad, ...]
    induced: tuple[str, ...]
    """Points whose acceleration is split by source, in the columns that begin with acc."""
    borne: tuple[BorneJoint, ...]
    """Joints whose whole wrench is told by its causes, in the columns that begin with reaction."""
    ignored: tuple[str, ...]
    """Columns of the log that belong to no joint."""
    warnings: tuple[str, ...]
    closed: ClosedLog | None = None
    """Largest violation of a constraint by positions of the log; None where no joints are tied."""
    times: ContactTimes | None = None
    """Times at which contacts are on, where there are any."""
    phases: tuple[PlacedPhase, ...] = ()
    """Phases that were asked for."""
    uncertain: Mapping[str, Any] | None = None
    """Uncertainty of bodies that was assumed, as the record has it; None without."""
    traced: Mapping[str, Any] | None = None
    """Joints, sources and windows of a trace, as the record has them; None without."""
    markers: MarkerLog | None = None
    """Recording of markers that the log was made of, with its errors; None for other logs."""

    def __repr__(self) -> str:
        size = f"{len(self.robot.joints)} joints, {len(self.robot.links)} links, {len(self.rows)} columns"
        return f"<analysis of {printable(short(self.source))}: {self.total} samples, {size}>"

    def __getitem__(self, name: str) -> Array:
        """Return a column (S,) by its name, as in the Parquet file: "tau/joint1/link2".

        Raises LinkwiseError for a name that no column has.
        """
        table = self.table
        if name not in table:
            near = listed(map(repr, nearest_first(name, table)))
            raise LinkwiseError(f"no column {name!r}; nearest are {near}")
        return table[name]

    @property
    def columns(self) -> tuple[Column, ...]:
        """Rows of `values` with names, units and indices, as the Parquet file has them."""
        return self.rows.columns

    @property
    def table(self) -> dict[str, Array]:
        """All columns (S,) by their names: pandas.DataFrame(result.table), polars.DataFrame(result.table)."""
        return {column.name: values for column, values in zip(self.columns, self.values, strict=True)}

    def parts(self) -> Iterator[Self]:
        """Yield results of some samples each, one after the other, until all samples are done.

        Memory holds few samples at a time. Totals, work and closure of each result are those of the whole
        movement.
        """
        most = max(LEAST, PART_BYTES // (8 * len(self.rows)))
        for at in range(0, self.values.shape[1], most):
            yield replace(self, values=self.values[:, at : at + most])
            let_go(self.values)

    @property
    def signs(self) -> CertainSigns:
        """Shares with their deviations at their largest magnitude, and whose sign is certain."""
        gradient = self.processing.convention == "gradient"
        robot = self.robot
        return CertainSigns(self.peaks, robot.joints, robot.links, gradient, robot.residuals_apart)

    @property
    def time(self) -> Array:
        """Time (S,) in s."""
        row: Array = self.values[0]
        return row

    @property
    def q(self) -> Array:
        """Joint coordinates (S, n) in rad or m, after the filter."""
        return self.dense("q")

    @property
    def qd(self) -> Array:
        """Joint velocities (S, n) in rad/s or m/s."""
        return self.dense("qd")

    @property
    def qdd(self) -> Array:
        """Joint accelerations (S, n) in rad/s² or m/s²."""
        return self.dense("qdd")

    @property
    def torque(self) -> Array:
        """Joint torques τ_i (S, n) in N·m or N."""
        return self.dense("tau")

    @property
    def partial_torque(self) -> Array:
        """Partial torques τ_ij (S, n, N), on joint i through link j, in N·m or N."""
        return self.dense("tau_link")

    @property
    def acceleration(self) -> Array:
        """τp_ij(q̈_k) (S, n, N, n), the part of τ_ij by the acceleration of coordinate k."""
        return self.dense("tau_qdd")

    @property
    def velocity(self) -> Array:
        """τp_ij(q̇_k) (S, n, N, n), the part of τ_ij by the velocity of coordinate k.

        It is in the convention of `processing`.
        """
        return self.dense("tau_qd")

    @property
    def gravity(self) -> Array:
        """g_ij (S, n, N), the part of τ_ij by gravity, or by all shares with names."""
        return self.dense("tau_share").sum(-1) if self.robot.is_written else self.dense("tau_gravity")

    @property
    def named_shares(self) -> Array:
        """Shares of τ_ij that are not of motion (S, n, N, M), by the robot's `share_names`."""
        return self.dense("tau_share") if self.robot.is_written else self.gravity[..., None]

    @property
    def load_torque(self) -> Array:
        """τ_ie (S, n, loads), the torque of joint i that carries load e, in N·m or N."""
        return self.dense("tau_load")

    @property
    def reactions(self) -> tuple[str, ...]:
        """Names of the joints whose whole wrench is told, as they were asked for."""
        return tuple(joint.name for joint in self.borne)

    @property
    def load_labels(self) -> tuple[str, ...]:
        """Names of the loads in figures, where a load on the foot differs from the foot's own share."""
        return tuple(borne.label for borne in self.loads)

    @property
    def power(self) -> Array:
        """Power P_ij = τ_ij q̇_i (S, n, N) in W that joint i sends into link j.

        Σ_i P_ij = d(K_j + P_j)/dt, less what contacts feed into link j where they slip.
        """
        return self.dense("power_link")

    @property
    def joint_power(self) -> Array:
        """Power P_i = τ_i q̇_i (S, n) in W of each joint."""
        return self.dense("power")

    @property
    def load_warnings(self) -> tuple[str, ...]:
        """Warnings about the files of loads, each with its file."""
        every = (*self.loads, *(() if self.times is None else self.times.loads))
        return tuple(dict.fromkeys(warning for load in every for warning in load.warnings))

    @property
    def provenance(self) -> str:
        """One line that says how the motion was derived."""
        made = self.processing
        parts = [f"{self.total:,} samples at {self.rate:.6g} Hz", f"{made.derivative} derivative"]
        if made.derivative == "savitzky-golay":
            parts[-1] += f" (window {made.window}, degree {made.degree})"
        parts.append(
            f"zero-phase Butterworth {made.lowpass.cutoff:g} Hz, order 2x{made.lowpass.order},"
            f" {made.lowpass.padding} padding"
            if made.lowpass is not None
            else "no filter"
        )
        parts += [f"{made.edges} edges", f"{made.convention} convention"]
        ends = (("from", made.start), ("to", made.stop))
        parts += [f"{word} {time:g} s" for word, time in ends if time is not None]
        for source in dict.fromkeys(borne.source for borne in self.loads):
            some = [borne for borne in self.loads if borne.source == source]
            names = f"{'muscles' if some[0].is_muscle else 'loads'} {listed([one.name for one in some])}"
            parts.append(printable(f"{names} of {source}" if source else names))
        cutoffs = sorted({borne.cutoff for borne in self.loads if borne.cutoff is not None})
        if self.robot.contacts is not None:
            parts.append(printable(f"contacts {listed(self.robot.contacts.names)}"))
        parts += [f"loads filtered at {cutoff:g} Hz" for cutoff in cutoffs]
        if self.uncertain is not None:
            parts.append(printable(f"uncertain as {self.uncertain['file']} says"))
            parts += map(printable, filter(None, [self.uncertain.get("note", ""), *self.signs.lines]))
        return " · ".join(parts)

    def require(self, *quantities: str) -> None:
        """Raise LinkwiseError where columns of these quantities were not asked for; of any unless given."""
        missing = sorted(self.rows.left_out.intersection(quantities or self.rows.left_out - {NET}))
        if missing:
            raise not_asked_for(missing)

    @property
    def constraint_force(self) -> Array:
        """Force in each row of the constraints, (S, C), in N or N·m; no column without constraints."""
        return self.dense("force")

    @property
    def constraint_force_by_link(self) -> Array:
        """Part of the constraint forces that each link causes, (S, N, C)."""
        return self.dense("force_link")

    @property
    def contact_wrench(self) -> Array:
        """Wrench of the ground on each contact, (S, contacts, 6): moment about its point, force; world axes.

        Moments are in N·m, forces in N.
        """
        ground, times = self.robot.contacts, self.times
        if ground is None or times is None:
            return np.zeros((len(self.time), 0, 6))
        model, q, forces = self.robot.model, self.q, self.constraint_force[:, self.robot.contact_rows]
        press = times.press(model, self.time, q)
        each = range(len(ground.names))
        return np.stack([ground.wrench(c, model, q, forces, press[:, c]) for c in each], axis=1)

    def dense(self, quantity: str) -> Array:
        """Return a quantity (S, …) over its axes, zero where it has no row.

        Raises LinkwiseError where columns of it were not asked for.
        """
        self.require(quantity)
        return self.rows.dense(quantity, self.values)

    def is_ever_on(self, contact: int) -> bool:
        """Return whether a contact is on at any sample."""
        return bool(self.totals.peak[self.rows.numbers("contact", contact=contact)].any())

    def largest_slip(self, contact: int) -> tuple[float, float]:
        """Return a contact's largest slip velocities while it is on, in m/s and rad/s, over all samples."""
        ground, (rows, _, at) = self.robot.contacts, self.rows["slip"]
        found = {"m": 0.0, "rad": 0.0}
        for peak, (row,) in zip(self.totals.peak[rows].tolist(), at.tolist(), strict=True):
            if ground is not None and ground.owners[row - self.robot.contact_rows.start] == contact:
                unit = self.rows.axes["constraint"].units[row]
                found[unit] = max(found[unit], peak)
        return found["m"], found["rad"]
