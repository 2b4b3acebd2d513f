"""Removal of what cancelling leaves in sums of rounded numbers, such as in sin² + cos² − 1."""

from collections.abc import Collection, Iterator, Mapping, Sequence

import sympy as sp

ROUNDING = 1e-12
"""Share of the largest coefficient below which a coefficient is rounding."""


def without_residue(
    terms: Sequence[sp.Expr], bounded: Collection[sp.Symbol], values: Mapping[sp.Symbol, sp.Float]
) -> Iterator[sp.Expr]:
    """Yield the terms that are not negligible: those whose number is small beside others' are dropped.

    A number gives the size of sines, cosines and powers of `bounded` symbols alone. Whatever else a term
    holds, as exp(15 q) or 1/q, may have any size: the term is compared with others of the same factor, and
    stays where there are none. Parameters may get other values than they have: what is dropped is small both
    without them, as if all of them were one, and with their `values`.
    """
    weighed = [(term, *_weighed(term, bounded, values)) for term in terms]
    largest: dict[sp.Expr, tuple[sp.Expr, sp.Expr]] = {}
    for _, apart, number, size in weighed:
        known = largest.get(apart, (0, 0))
        largest[apart] = max(known[0], number), max(known[1], size)
    for term, apart, number, size in weighed:
        most = largest[apart]
        if number > ROUNDING * most[0] or size > ROUNDING * most[1]:
            yield term


def _weighed(
    term: sp.Expr, bounded: Collection[sp.Symbol], values: Mapping[sp.Symbol, sp.Float]
) -> tuple[sp.Expr, sp.Expr, sp.Expr]:
    """Return factors of any size, the coefficient, and this times the factors of parameters alone."""
    number, rest = term.as_coeff_Mul()
    size, apart = number, sp.S.One
    for factor in sp.Mul.make_args(rest):
        if factor.free_symbols <= values.keys():
            size *= factor.xreplace(values)
        elif not _is_bounded(factor, bounded):
            apart *= factor
    size = abs(sp.N(size))
    return apart, abs(number), size if size.is_comparable else sp.S.Zero


def _is_bounded(factor: sp.Expr, bounded: Collection[sp.Symbol]) -> bool:
    base, exponent = factor.as_base_exp()
    whole = exponent.is_Integer and exponent > 0
    return bool(whole and (base in bounded or isinstance(base, (sp.sin, sp.cos))))
