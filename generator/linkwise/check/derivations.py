"""Derivations of one robot against each other: closed forms, the vectorised rule, differentiated Lagrangians.

Each is held against the recursion by itself; here they are held together, two at a time.
"""

from collections.abc import Iterator, Mapping
from itertools import combinations

from linkwise.check.compare import Entries, Result, compare
from linkwise.check.packed_layout import IndexRows, spread
from linkwise.check.reference import Reference
from linkwise.package.load import Array, Model

NAMES = {
    "closed forms": ("numpy", "torch"),
    "rule": ("numpy by rule", "torch by rule"),
    "Lagrangians": ("autograd",),
}
"""Derivations, and under which names a back end computes by them: the first that is there speaks for it."""


def derivations(
    loaded: Mapping[str, Model], rows: IndexRows, reference: Reference, how: str, label: str
) -> Iterator[Result]:
    """Hold every two derivations that are there together; `how` closed forms were found goes into the name.

    loaded: back ends by the name that their results are told under
    """
    found = {
        derivation: next((loaded[name] for name in names if name in loaded), None)
        for derivation, names in NAMES.items()
    }
    answers = {
        f"{derivation} ({how})" if derivation == "closed forms" else derivation: _dense(
            model, rows, reference
        )
        for derivation, model in found.items()
        if model is not None
    }
    for one, other in combinations(answers, 2):
        entries = [
            Entries(what, value, answers[other][what], reference.scales[what])
            for what, value in answers[one].items()
        ]
        yield compare(f"derivations{label}: {one} against {other}", entries, reference.tolerance)


def _dense(model: Model, rows: IndexRows, reference: Reference) -> dict[str, Array]:
    motion = reference.states.motion
    values = {**rows.fields(model.packed(*motion)), "c0": model.position_gradient(*motion)}
    return {
        what: value if what == "c0" else spread(value, rows.of(what), reference, what)
        for what, value in values.items()
    }
