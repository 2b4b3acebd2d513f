"""Derivations of one robot against each other: closed forms, the vectorised rule, differentiated Lagrangians.

Each is held against the recursion by itself; here they are held together, two at a time.
"""

from collections.abc import Iterator, Mapping
from itertools import combinations

from linkwise_runtime.dynamics import Dynamics

from linkwise.check.compare import Entries, Result, compare
from linkwise.check.packed_layout import IndexRows
from linkwise.check.reference import Reference
from linkwise.package.load import Array

NAMES = {
    "closed forms": ("numpy", "torch"),
    "rule": ("numpy by rule", "torch by rule"),
    "Lagrangians": ("autograd",),
}
"""Derivations, and under which names a back end computes by them: the first that is there speaks for it."""


def derivations(
    loaded: Mapping[str, Dynamics], rows: IndexRows, reference: Reference, how: str, label: str
) -> Iterator[Result]:
    """Hold every two derivations that are there together; `how` closed forms were found goes into the name.

    loaded: back ends by the name that their results are told under
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
        yield compare(f"derivations{label}: {one} against {other}", entries, reference.tolerance)


def _answers(model: Dynamics, rows: IndexRows, reference: Reference) -> dict[str, tuple[Array, Array]]:
    """Packed values and slopes by position, each beside its scale."""
    few = slice(-2, None) if reference.is_large else slice(None)
    motion = reference.states.at(few).motion
    found = {
        what: (value, reference.scales[what][few][(slice(None), *rows.of(what).T)])
        for what, value in rows.fields(model.packed(*motion)).items()
    }
    return found | {"c0": (model.position_gradient(*motion), reference.scales["c0"][few])}
