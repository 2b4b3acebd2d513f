"""Derivations of one robot compared: closed forms, the vectorised rule, differentiated Lagrangians.

Each is also compared with the recursion by itself; here they are compared two at a time.
"""

from collections.abc import Iterator, Mapping
from itertools import combinations
from typing import Any

import numpy as np
from linkwise_runtime.dynamics import Dynamics

from linkwise.check.compare import Entries, IndexRows, Result, compare
from linkwise.check.model_calls import Named
from linkwise.oracle.reference import Reference
from linkwise.package.load import Array

NAMES = {
    "closed forms": ("numpy", "torch"),
    "rule": ("numpy by rule", "torch by rule"),
    "Lagrangians": ("autograd",),
}
"""Derivations, and names of the back ends that compute by them: the first that is there represents it."""


def derivations(
    name: str, loaded: Mapping[str, Dynamics], rows: IndexRows, reference: Reference, how: str
) -> Iterator[Result]:
    """Yield a comparison of every two derivations that are there.

    how: how the closed forms were found, for the result's name
    loaded: back ends by the name that their results are reported under
    """
    found = {
        derivation: next((loaded[name] for name in names if name in loaded), None)
        for derivation, names in NAMES.items()
    }
    answers = {
        f"{derivation} ({how})" if derivation == "closed forms" else derivation: _answers(
            model, rows, reference
        )
        for derivation, model in found.items()
        if model is not None
    }
    for one, other in combinations(answers, 2):
        entries = [
            Entries(what, value, answers[other][what][0], scale, None if what == "c0" else rows.of(what))
            for what, (value, scale) in answers[one].items()
        ]
        yield compare(f"{name}: {one} against {other}", entries, reference.tolerance)


def _answers(model: Dynamics, rows: IndexRows, reference: Reference) -> dict[str, tuple[Array, Array]]:
    """Return packed values and slopes by position, each beside its scale."""
    few = slice(-2, None) if reference.is_large else slice(None)
    motion = reference.states.at(few).motion
    found = {
        what: (value, reference.scales[what][few][(slice(None), *rows.of(what).T)])
        for what, value in rows.fields(model.packed(*motion)).items()
    }
    return found | {"c0": (model.position_gradient(*motion), reference.scales["c0"][few])}


STATES = 10
"""Most states."""
PAIRS = 6
"""Most torques tau_ij: each is recorded anew."""
CARRIERS = 16
"""Most joints that carry the link of a recorded torque, in a large robot."""
OPERATIONS = 2500
"""Most operations run in all: where there are more, every tau_ij has its share, by parts picked at random."""


def recorded_parts(checked: Named) -> Result:
    """Compare c2_ijk qdd_k, c1_ijk qd_k and g_ij with the reference, each from its graph, zero without."""
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
    # Recording a torque takes longer, the more joints carry the link.
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
    """Return a part of order m beside its value in the reference."""
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
