"""Rows of `tests.parquet`: one for each part of a cycle that is above the threshold, or for a column."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict

import numpy as np

from linkwise.study.comparisons import Compared
from linkwise.study.effect_sizes import KINDS
from linkwise.study.t_tests import Cluster, told_p

NOWHERE = Cluster(np.nan, np.nan, np.nan)


def rows_of_tests(tests: Sequence[Compared]) -> Iterator[dict[str, object]]:
    """Yield the rows of all tests; those of parts that are too brief to differ say so."""
    for test in tests:
        parts = [(part, True) for part in test.clusters] + [(part, False) for part in test.brief]
        is_mean = len(test.statistic) == 1
        nowhere = Cluster(np.nan, np.nan, test.p) if is_mean else NOWHERE
        for part, differs in sorted(parts, key=lambda one: one[0].start) or [(nowhere, False)]:
            at, effect = test.effect(part if parts else None)
            yield {
                **_about(test),
                "differs": differs,
                "start": part.start,
                "end": part.end,
                "p": part.p,
                "p_told": told_p(part.p, test.level),
                "at": at,
                **asdict(effect),
                "effect_is": KINDS[test.comparison.paired],
            }


def _about(test: Compared) -> dict[str, object]:
    """Return what all rows of a column have."""
    first, second = test.comparison.between
    return {
        "factor": test.comparison.factor,
        "first": first,
        "second": second,
        "column": test.column,
        "unit": test.unit,
        "first_subjects": len(test.sides[0].each),
        "second_subjects": len(test.sides[1].each),
        "left_out": ", ".join(test.left_out),
        "paired": test.comparison.paired,
        "alpha": test.comparison.alpha,
        "correction": test.comparison.correct,
        "columns_corrected_for": test.family,
        "level": test.level,
        "t": float(test.statistic[np.abs(test.statistic).argmax()]),
        "threshold": test.threshold,
        "p_column": test.p,
        "p_column_adjusted": test.adjusted,
        "p_column_told": told_p(test.adjusted, test.comparison.alpha),
    }
