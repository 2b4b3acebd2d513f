"""Tables of measured values as expressions, for energies and forces."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy as sp

from linkwise.errors import LinkwiseError
from linkwise.escape import short

MOST_DEGREE = 5


def interpolated(x: sp.Expr, places: Sequence[float], values: Sequence[float], degree: int = 3) -> sp.Expr:
    """Return a spline through values at places, as a function of x: a Piecewise of polynomials of a degree.

    places: at least degree + 1, ascending; beyond the first and the last, their polynomials go on

    It is `sympy.interpolating_spline`, which has no value beyond the places. Raises LinkwiseError for places
    that do not ascend, for too few, and for what is no finite number.
    """
    try:
        at, found = (np.array([*given], dtype=float) for given in (places, values))
    except (TypeError, ValueError):
        raise LinkwiseError("a table needs numbers; places or values have something else") from None
    if at.ndim != 1 or at.shape != found.shape or not np.isfinite([at, found]).all():
        raise LinkwiseError("a table needs as many finite values as places")
    if isinstance(degree, bool) or not isinstance(degree, int) or not 1 <= degree <= MOST_DEGREE:
        raise LinkwiseError(f"the degree of a table is {short(repr(degree))}; give 1 to {MOST_DEGREE}")
    if len(at) <= degree:
        raise LinkwiseError(f"a table of degree {degree} needs {degree + 1} places, and has {len(at)}")
    if (np.diff(at) <= 0).any():
        raise LinkwiseError("the places of a table do not ascend; sort them, each once")
    spline: Any = sp.interpolating_spline(degree, sp.Dummy("x", real=True), at.tolist(), found.tolist())
    pieces = spline.args if isinstance(spline, sp.Piecewise) else [(spline, sp.true)]
    (inner,) = spline.free_symbols or {sp.Dummy("x")}
    # Ends of the pieces but the last: the largest numbers in their conditions.
    ends = [max(condition.atoms(sp.Number)) for _, condition in pieces[:-1]]
    chosen = [(piece, inner < end) for (piece, _), end in zip(pieces[:-1], ends, strict=True)]
    return sp.Piecewise(*chosen, (pieces[-1][0], True)).xreplace({inner: x})
