"""Graphs that autograd records, run part by part, against the reference."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from linkwise.check.compare import Entries, Result, compare
from linkwise.check.model_calls import Named
from linkwise.check.reference import Reference
from linkwise.package.load import Array

STATES = 10
"""States at most."""
PAIRS = 6
"""Torques tau_ij at most: each is recorded anew."""
CARRIERS = 16
"""Joints that carry the links of these, at most, in a large robot."""
OPERATIONS = 2500
"""Run in all, at most: where there are more, every tau_ij has its share, by parts picked at random."""


def recorded_parts(checked: Named) -> Result:
    """c2_ijk qdd_k, c1_ijk qd_k and g_ij, each by its own graph, or zero where there is none."""
    reference = checked.reference
    return compare(
        f"{checked.name}: graphs of parts of tau_ij against {reference.name}",
        _parts(checked),
        reference.tolerance,
    )


def _parts(checked: Named) -> Iterator[Entries]:
    reference, joints = checked.reference, list(checked.model.joint_names)
    few = reference.states.at(slice(STATES))
    generator, run = np.random.default_rng(0), 0
    asked = [(None, 0), *((k, m) for k in range(len(joints)) for m in (1, 2))]
    # To record a torque takes the longer, the more joints carry the link.
    carriers = np.bincount(checked.rows.tau[:, 1])
    most = max(CARRIERS, carriers.min()) if reference.is_large else carriers.max()
    near = checked.rows.tau[carriers[checked.rows.tau[:, 1]] <= most]
    pairs = generator.permutation(near)[:PAIRS].tolist()
    backend: Any = checked.model.backend
    for i, j in pairs:
        graphs = {(part.coordinate, part.order): part for part in backend.graph_parts(i, j)}
        own = 0
        for k, m in (asked[at] for at in generator.permutation(len(asked))):
            found, graph = np.zeros(len(few.q)), graphs.get((None if k is None else joints[k], m))
            if graph is not None:
                if max(own * len(pairs), run) > OPERATIONS:
                    continue
                found = graph.evaluate(*few.motion).detach().numpy()
                own, run = own + len(graph.operations), run + len(graph.operations)
            yield _entries(reference, (i, j, k), m, found)


def _entries(reference: Reference, at: tuple[int, int, int | None], m: int, found: Array) -> Entries:
    """A part of order m, and what the reference says of it."""
    i, j, k = at
    place = (i, j) if k is None else (i, j, k)
    row = (slice(len(found)), *place)
    motion = np.ones(len(found)) if k is None else reference.states.motion[m][: len(found), k]
    what = ("g", "c1", "c2")[m]
    return Entries(
        f"{what}({', '.join(str(index + 1) for index in place)})",
        found,
        reference.values[what][row] * motion,
        reference.scales[what][row] * np.abs(motion),
    )
