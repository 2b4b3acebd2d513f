"""A motion without one of its sources: simulated, and to first order.

What the motion needed of its actuators, and what its loads were, is given again over time, less a part p of
one source, and the robot moves as it then must:

    tau(t) - p F_s(t, q, qd)        p = 0: as it was    p = 1: without the source

The first order is the slope of that motion by p at p = 0, by central differences.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from ..chosen_names import choice, short
from ..constraints.closed_places import times
from ..interface import Numbers, namespace
from ..motion_quantities import Counterfactual
from ..quantities import AppliedLoad
from .between_samples import cubic, sample_slopes
from .induced_accelerations import DrivenRobot
from .simulated import Simulated, simulate_motion
from .trace_equations import BETWEEN, RESIDUAL, START, TORQUE
from .traced import ReadTrace, Traced, read_trace

SMALL = 1e-3
"""Part of a source that is left out, and given once more, for the first order."""
PARTS = (0.0, 1.0, SMALL, -SMALL)
"""Parts p of the motions that are simulated side by side."""


class Without(NamedTuple):
    """Arguments of `Dynamics.counterfactual`."""

    motion: Traced
    without: object
    step: object


def counterfactual_motion(robot: DrivenRobot, asked: Without) -> Counterfactual[Any]:
    """Return the answer of `Dynamics.counterfactual`."""
    read = read_trace(robot, asked.motion)
    again = DrivenAgain.of(read, _known(asked.without, read.equations.sources))
    q, qd = read.samples.q, read.samples.qd
    start = qd[0] * (1.0 - again.parts) if again.source == START else qd[0] + 0.0 * again.parts
    ties = read.equations.constraints
    moved = simulate_motion(
        robot,
        Simulated(
            q=q[0] + 0.0 * again.parts,
            qd=start,
            time=read.times,
            tau=again.torque,
            loads=again.loads,
            passive=read.equations.passive,
            step=asked.step,
            method="RK4",
            rtol=1e-9,
            atol=1e-12,
            constraints=False if ties is None else ties,
            inputs=None,
        ),
    )
    slopes = [(a[:, 2] - a[:, 3]) / (2.0 * SMALL) for a in (moved.q, moved.qd)]
    return Counterfactual(
        moved.time, moved.q[:, 1], moved.qd[:, 1], q + slopes[0], qd + slopes[1], moved.q[:, 0] - q
    )


def _known(source: object, sources: Sequence[str]) -> str:
    if not isinstance(source, str) or source not in sources:
        raise ValueError(f"without is {short(source)}; choose a source: {choice(source, sources, 'sources')}")
    return source


@dataclass(frozen=True)
class DrivenAgain:
    """Forces of a motion that are given again over time, less parts of one source."""

    read: ReadTrace
    source: str
    parts: Numbers
    """p (4, ..., 1), beside positions (4, ..., n)."""
    driven: Numbers
    """Torques that the motion needed of the actuators, and the source's part in them, (T, ..., n, 2)."""

    @classmethod
    def of(cls, read: ReadTrace, source: str) -> "DrivenAgain":
        """Return the forces of a motion that was read."""
        equations, q = read.equations, read.samples.q
        parts = equations.backend.weights("parts", PARTS, q).reshape(-1, *[1] * (q.ndim - 1))
        own = [equations.backend.structure.joint_names.index(name) for name in equations.coordinates]
        unit = equations.backend.constant(np.eye(q.shape[-1])[:, own], q)
        forces = equations.at(read.samples, True).equations.forces
        if equations.torques_given:
            given = read.samples.given[..., 0]
            left = times(unit, forces[..., equations.sources.index(RESIDUAL)])
        else:
            given, left = times(unit, forces[..., : len(own)].sum(-1)), 0.0 * q
        kind, _, joint = source.partition(BETWEEN)
        driven = kind in (TORQUE, RESIDUAL)
        there = [float(driven and joint == name) for name in equations.backend.structure.joint_names]
        part = given * equations.backend.constant(there, q) + left * float(source == RESIDUAL)
        return cls(read, source, parts, namespace(q).stack([given + left, part], -1))

    def torque(self, t: float, q: Numbers, qd: Numbers) -> Numbers:
        """Return the torques of the actuators, (4, ..., n)."""
        needed = self._at(t, self.driven)
        return needed[..., 0] - self.parts * (needed[..., 1] + self._of_state(t, q, qd))

    def _of_state(self, t: float, q: Numbers, qd: Numbers) -> Numbers:
        """Return the force (4, ..., n) of a source that depends on where the robot is; else zeros."""
        kind = self.source.partition(BETWEEN)[0]
        if kind in (TORQUE, RESIDUAL, START):
            return 0.0 * q
        equations = self.read.equations
        backend = equations.at_instants(equations.backend.weights("time", [t], q), q)
        sources = equations.sources
        vectors = [0.0 * q[..., :1] + self._at(t, vector) for vector in self.read.vectors]
        pulls = [-pull for pull in self.read.loads.torques(backend, q, vectors)]
        loads = namespace(q).stack(pulls, -1) if pulls else q[..., None][..., :0]
        columns = equations.forces(backend, q, qd, backend.answers.coefficients(q, qd)[2], loads)
        first = next(
            k for k, name in enumerate(sources) if name.partition(BETWEEN)[0] not in (TORQUE, RESIDUAL)
        )
        return columns[..., sources.index(self.source) - first]

    def loads(self, t: float, q: Numbers, qd: Numbers) -> list[list[AppliedLoad]]:
        """Return the loads at an instant."""
        names = list(self.read.loads.beside)
        found = []
        for load in self.read.loads.each:
            several = []
            for frame, vectors in load:
                at = {
                    what: self._at(t, self.read.vectors[names.index(name)]) for what, name in vectors.items()
                }
                several.append(AppliedLoad(frame, **at))
            found.append(several)
        return found

    def _at(self, t: float, values: Numbers) -> Numbers:
        """Return what values of the samples, (T, ...), are at an instant, (...)."""
        instants = self.read.times
        k = int(np.clip(np.searchsorted(instants, t, side="right") - 1, 0, len(instants) - 2))
        near = slice(max(0, k - 1), k + 3)
        length = instants[k + 1] - instants[k]
        lengths = self.read.samples.steps[near.start : near.start + len(values[near]) - 1]
        slopes = sample_slopes(lengths, values[near])
        own = slice(k - near.start, k - near.start + 2)
        steps = self.read.samples.lengths[k : k + 1].reshape(-1, *[1] * (values.ndim - 1))
        return cubic((t - instants[k]) / length, steps, values[near][own], slopes[own])[0][0]
