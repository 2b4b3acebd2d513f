"""Forces on the coordinates by source, side by side as columns.

    M qdd = u - sum_js c1_ijs qd_s - sum_j g_ij - spring - damping - friction + sum_e J_e^T w_e

with armature on the diagonal of M where the joints' own torques count.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from ..arguments import Beside
from ..arrays.backend import ArrayBackend
from ..chosen_names import known_kind, numbered
from ..interface import Numbers, namespace
from ..kinematics.frame_answers import frame_index, vectors_beside
from ..kinematics.robot_kinematics import check_load
from ..kinematics.wrench_answers import OnFrame
from ..quantities import AppliedLoad


class SourceForces(NamedTuple):
    """Columns of generalised forces (..., n, X): those of actuators first, once they are known."""

    mass: Numbers
    """M (..., n, n)."""
    columns: Numbers
    tails: tuple[tuple[int, ...], ...]
    """Shapes of the sources of each kind, which follow each other in the columns."""
    by_link: Numbers
    """Mass matrix of each link, c2 (..., n, N, n)."""

    def split(self, columns: Numbers) -> list[Numbers]:
        """Return the columns of each kind of source, (..., r, *tail), of columns (..., r, X)."""
        parts, start = [], 0
        for tail in self.tails:
            end = start + math.prod(tail)
            parts.append(columns[..., start:end].reshape(*columns.shape[:-1], *tail))
            start = end
        return parts


def source_forces(
    backend: ArrayBackend, q: Numbers, qd: Numbers, pulls: Sequence[Numbers], passive: bool
) -> SourceForces:
    """Return the forces of all sources but actuators.

    In this order: velocity (N, n), gravity (N), passive (3, n), loads (L).
    pulls: torques that each load needs from the joints, (..., n)
    """
    structure = backend.structure
    n, links, own = structure.n, structure.N, structure.passive_sums
    c2, c1, gravity = backend.answers.coefficients(q, qd)
    kinds = [-(c1 * qd[..., None, None, :]).reshape(*q.shape, links * n), -gravity]
    mass, rest = c2.sum(-2), 0.0 * q
    identity = backend.constant(np.eye(n), q)
    shares: Sequence[Numbers] = (rest,) * 3
    if passive and structure.passive:
        shares = backend.answers.passive_torque(q, qd, rest)[:3]
        mass = mass + backend.constant(np.diag(own.armature), q)
    kinds += [-identity * share[..., None, :] for share in shares]
    kinds += [-torque[..., None] for torque in pulls]
    return SourceForces(
        mass, namespace(mass).concat(kinds, -1), ((links, n), (links,), (3, n), (len(pulls),)), c2
    )


def with_actuators(forces: SourceForces, tau: Numbers, identity: Numbers) -> SourceForces:
    """Return the forces with columns for the torques (..., n) of actuators before them."""
    columns = namespace(tau).concat([identity * tau[..., None, :], forces.columns], -1)
    return forces._replace(columns=columns, tails=((tau.shape[-1],), *forces.tails))


@dataclass(frozen=True)
class AppliedLoads:
    """Loads as they were given, whose vectors are read beside motion."""

    each: Sequence[Sequence[OnFrame]]
    """Forces and moments of each load."""
    beside: Mapping[str, Beside]

    def names(self, backend: ArrayBackend) -> tuple[str, ...]:
        """Return names of the loads: those of their frames, numbered where a frame has several."""
        frames = ([backend.frames.names[one.frame] for one in load] for load in self.each)
        return numbered(" and ".join(dict.fromkeys(names)) for names in frames)

    def torques(self, backend: ArrayBackend, q: Numbers, vectors: Sequence[Numbers]) -> list[Numbers]:
        """Return the torques that each load adds to those that joints need, (..., n).

        vectors: values read for `beside`
        """
        return [sum(parts, 0.0 * q) for parts in self.torques_by_frame(backend, q, vectors)]

    def torques_by_frame(
        self, backend: ArrayBackend, q: Numbers, vectors: Sequence[Numbers]
    ) -> list[list[Numbers]]:
        """Return these torques by each force and moment of each load, in the order of `each`."""
        named = dict(zip(self.beside, vectors, strict=True))

        def torque(frame: int, names: Mapping[str, str]) -> Numbers:
            own = {what: named[name] for what, name in names.items()}
            return backend.frames.answer("load_torque", [q], frame, own)

        return [[torque(*one) for one in load] for load in self.each]


def loads_of(backend: ArrayBackend, given: object) -> AppliedLoads:
    """Return the loads of a robot on this back end; raises TypeError and ValueError, which name the load."""
    if isinstance(given, AppliedLoad):
        given = [given]
    if not isinstance(given, list | tuple) or hasattr(given, "_fields"):
        raise TypeError(f"loads is {_kind(given)}; give a list of AppliedLoad(frame, force, ...)")
    each: list[list[OnFrame]] = []
    asked: dict[str, Beside] = {}
    for e, load in enumerate(given):
        several = [load] if isinstance(load, AppliedLoad) else load
        if not isinstance(several, list | tuple) or not all(isinstance(a, AppliedLoad) for a in several):
            raise TypeError(
                f"loads[{e}] is {_kind(load)}; give AppliedLoad(frame, force, ...), or a list of "
                "them that counts as one load"
            )
        each.append([])
        for s, (frame, force, moment, point, at) in enumerate(several):
            place = f"loads[{e}]" if several[0] is load else f"loads[{e}][{s}]"
            try:
                check_load(force, point, at)
                number = frame_index(frame, backend.frames.names)
            except (TypeError, ValueError) as error:
                raise type(error)(f"{place}: {error}") from None
            vectors = {"force": force, "moment": moment, "point": point, "at": at}
            found = vectors_beside(vectors, f"{place}.")
            each[-1].append(OnFrame(number, {name.removeprefix(f"{place}."): name for name in found}))
            asked |= found
    return AppliedLoads(each, asked)


def _kind(given: object) -> str:
    """Return how an error names what is no load.

    A load of another copy of the runtime, also in a list, is named with that copy.
    """
    among = given if isinstance(given, list) else [given]
    alike = [one for one in among if type(one).__name__ == AppliedLoad.__name__]
    return known_kind(alike[0], AppliedLoad) if alike else f"a {type(given).__name__}"
