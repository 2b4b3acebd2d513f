"""Rows of a result that trace velocities, and the torques that they ask for, back to sources.

With C_ik = Σ_j c1_ijk, each source s of forces has velocities v_s that M dv_s/dt + C v_s = F_s gives, as
`Dynamics.trace` says: Σ_s v_s = q̇. What the velocity of joint k asks of joint i, Σ_j c1_ijk q̇_k, is thereby
Σ_s C_ik v_sk. Contacts come, go and slip in a measured motion: the force of each is a source of its own, and
they leave of C v_s to the joints what they leave of any torque.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any, NamedTuple, cast

import numpy as np
from linkwise_runtime.arrays.backend import ArrayBackend
from linkwise_runtime.constraints.independent_joints import loose_base
from linkwise_runtime.motion.between_samples import SampledMotion, sample_slopes
from linkwise_runtime.motion.trace_equations import BETWEEN, LOAD, TORQUE, TraceEquations
from linkwise_runtime.motion.traced import check_traceable
from linkwise_runtime.motion.tracer import Tracer, TraceState

from linkwise.analysis.asked_trace import AskedTrace
from linkwise.analysis.contacts.ground import Standing
from linkwise.analysis.induced_sources import opened, refuse_tensors, timed
from linkwise.analysis.loads.placed import PlacedLoad
from linkwise.analysis.measured_torques import MeasuredTorques
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.payload import PayloadModel
from linkwise.analysis.result_rows import Place, ResultRows
from linkwise.analysis.samples import Samples
from linkwise.analysis.verify import Closure, worst_of
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError

CONTACT = "contact"
MOST = 100_000
"""Most columns of a trace; more are a mistake in the length of windows."""


class ExtendedBlock(NamedTuple):
    """Samples of a block, with one before it and two behind it where there are any.

    A step leads to the first sample behind it, and slopes need their neighbours.
    """

    first: int
    """Number of the first of these samples."""
    begin: int
    """Number of the block's first sample."""
    end: int
    """Number of the sample behind the block."""
    last: int
    """Number of the movement's last sample."""

    @property
    def own(self) -> slice:
        """Samples of the block among these."""
        return slice(self.begin - self.first, self.end - self.first)

    @property
    def with_next(self) -> slice:
        """Samples of the block, and the one behind it if there is one."""
        return slice(self.begin - self.first, min(self.end, self.last) + 1 - self.first)


@dataclass(frozen=True)
class TracedRows:
    """Fills the rows of a trace."""

    asked: AskedTrace
    robot: OpenedRobot
    loads: tuple[PlacedLoad, ...]
    tracer: Tracer
    measured: MeasuredTorques | None
    """Torques that actuators gave; else they give what the motion needs."""

    @classmethod
    def of(
        cls,
        asked: AskedTrace,
        robot: OpenedRobot,
        loads: Sequence[PlacedLoad],
        samples: Samples,
        measured: MeasuredTorques | None,
    ) -> "TracedRows":
        """Return the rows of a robot's trace; samples have the inputs that it depends on, if any."""
        refuse_tensors(robot, "a --trace is")
        ties = None if robot.constrained is None else robot.constrained.constraints
        contacts = () if robot.contacts is None else robot.contacts.names
        given = [f"{LOAD}{BETWEEN}{borne.name}" for borne in loads]
        given += [f"{CONTACT}{BETWEEN}{name}" for name in contacts]
        model: Any = robot.model

        def backend_at(time: Array) -> ArrayBackend:
            inputs = [np.interp(time, samples.time, own) for own in samples.inputs.T]
            at = opened(robot.at(time, np.array(inputs).reshape(len(inputs), len(time)).T))
            return cast(ArrayBackend, at.backend)

        carried = tuple(part.model.backend for part in model.parts) if isinstance(model, PayloadModel) else ()
        try:
            check_traceable(robot.structure)
        except ValueError as error:
            raise LinkwiseError(f"--trace: {error}") from None
        loose = () if robot.tree is None else loose_base(robot.tree)
        if robot.contacts is not None:
            loose = robot.contacts.unactuated
        equations = TraceEquations(
            model.backend,
            ties,
            passive=True,
            torques_given=measured is not None,
            given=tuple(given),
            is_borne=asked.is_borne,
            loose=loose,
            carried=carried,
            backend_at=cast(Any, backend_at) if robot.time_name or robot.inputs else None,
        )
        return cls(asked, robot, tuple(loads), Tracer(equations, asked.parts), measured)

    @property
    def origins(self) -> tuple[str, ...]:
        """Names of the sources, each in every window of time if there are several."""
        sources, windows = self.tracer.equations.sources, self.asked.windows
        if len(windows) == 1:
            return sources
        return tuple(f"{source} {begin:.15g}..{end:.15g} s" for source in sources for begin, end in windows)

    def places(self, velocity: Sequence[Place]) -> list[Place]:
        """Return the places of its rows; velocity: those of the torques by velocity.

        Raises LinkwiseError for more columns than anybody reads.
        """
        windows, parts = len(self.asked.windows), self.asked.parts
        begun = np.searchsorted(parts.cuts, parts.restarts, side="right") - 1
        start = len(self.origins) - windows
        silent = set[str]()
        if self.measured is not None:  # what has no measured torque gives none
            with_torque = {self.robot.joints[i] for i in self.measured.joints}
            silent = {f"{TORQUE}{BETWEEN}{joint}" for joint in {*self.robot.joints} - with_torque}
        every = [o for o in range(start) if self.tracer.equations.sources[o // windows] not in silent]
        every += [start + w for w in sorted({int(w) for w in begun})]
        found: list[Place] = []
        for i in self.asked.joints:
            causes = sorted({at[2] for _, at in velocity if at[0] == i})
            found += [("qd_from", (i, o)) for o in every]
            found += [("tau_from", (i, k, o)) for k in causes for o in every]
        found += [("kinetic_from", (o,)) for o in every]
        if len(found) > MOST:
            raise LinkwiseError(
                f"--trace: {len(self.asked.joints)} joints, {len(every)} sources in windows of"
                f" time come to {len(found):,} columns; name fewer joints, or give a greater --trace-windows"
            )
        return found

    def record(self) -> dict[str, Any]:
        """Return the trace as plain data: joints, sources, windows in s, samples at which it begins anew."""
        return {
            "joints": [self.robot.joints[i] for i in self.asked.joints],
            "sources": list(self.tracer.equations.sources),
            "weight": "borne" if self.asked.is_borne else "apart",
            "measured": {}
            if self.measured is None
            else {
                self.robot.joints[i]: column
                for i, column in zip(self.measured.joints, self.measured.columns, strict=True)
            },
            "windows": [list(window) for window in self.asked.windows],
            "begins_at_samples": list(self.asked.parts.restarts),
        }

    def fill(
        self,
        rows: ResultRows,
        out: Array,
        block: ExtendedBlock,
        standing: Standing | None,
        state: TraceState | None,
    ) -> tuple[Closure, TraceState | None]:
        """Fill the rows of an extended block's own samples in `out` (rows, S), whose torques are filled.

        state: that at the block's first sample, None at the movement's; returned is that behind the block
        """
        time, (q, qd, qdd) = out[0], (out[rows[name].rows].T for name in ("q", "qd", "qdd"))
        given = self._given(rows, out, block, standing, q)
        steps = np.diff(time, append=time[-1])
        motion = SampledMotion(time, steps, q, qd, qdd, given, sample_slopes(steps[:-1], given))
        samples = range(len(time))[block.with_next]
        part = motion.some(samples.start, samples.stop)
        try:
            found, state = self.tracer.advance(part, block.begin, cast(Any, state))
        except ValueError as error:
            raise LinkwiseError(f"--trace: {timed(str(error), time, '--trace')}") from error
        count = block.end - block.begin
        velocity, energy, coriolis = (
            np.asarray(cast(Any, a))[:count] for a in (found.velocity, found.energy, found.coriolis)
        )
        there = None if standing is None else standing.some(block.own)
        by_origin = [a.reshape(*a.shape[:-2], -1) for a in (velocity, energy)]
        self._put(rows, out[:, block.own], by_origin[0], by_origin[1], coriolis, there)
        parts = np.abs(velocity).sum((-2, -1)).max(initial=0.0)
        left = float(np.abs(velocity.sum((-2, -1)) - qd[block.own]).max(initial=0.0))
        absolute, relative = worst_of([(left, float(parts))])
        return Closure(trace_absolute=absolute, trace_relative=relative), state

    def _given(
        self, rows: ResultRows, out: Array, block: ExtendedBlock, standing: Standing | None, q: Array
    ) -> Array:
        """Return the forces (S, n, Y) of actuators, where measured, of loads, then of contacts, on joints."""
        model, time = opened(self.robot), out[0]
        forces = []
        if self.measured is not None:
            forces.append(self.measured.some(block.first, block.first + len(q)).dense(q.shape[1]))
        forces += [-borne.torque(model, time, q) for borne in self.loads]
        ground = self.robot.contacts
        if standing is not None and ground is not None:
            borne_there = rows.dense("force", out)[:, self.robot.contact_rows]
            each = standing.every * borne_there[..., None]
            forces += [each[:, ground.owners == c].sum(1) for c in range(len(ground.names))]
        return np.stack(forces, axis=-1) if forces else np.zeros((*q.shape, 0))

    def _put(
        self,
        rows: ResultRows,
        out: Array,
        velocity: Array,
        energy: Array,
        coriolis: Array,
        standing: Standing | None,
    ) -> None:
        """Fill rows of a block in `out` (rows, S) from v_s (S, n, o), energies (S, o) and C (S, m, m)."""
        for row, (i, o) in rows["qd_from"].listed():
            out[row] = velocity[:, i, o]
        for row, (o,) in rows["kinetic_from"].listed():
            out[row] = energy[:, o]
        independent = list(self.robot.driven)
        for (i, k), of_pair in groupby(rows["tau_from"].listed(), key=lambda place: tuple(place[1][:2])):
            # C v_s of cause k on all joints, (S, n, o), of which contacts leave a part to joint i.
            torque = np.zeros(velocity.shape)
            torque[:, independent] = coriolis[:, :, independent.index(k), None] * velocity[:, k, None]
            left = (torque if standing is None else standing.left(torque))[:, i]
            for row, (_, _, o) in of_pair:
                out[row] = left[:, o]
