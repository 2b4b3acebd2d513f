"""Verdicts on the paper's claim in words: where counts confirm it, and where they are weaker or stronger."""

from collections.abc import Iterator
from math import exp

from linkwise.report.curve_fit import (
    PAPER_A,
    PAPER_RATE,
    CountPolynomial,
    Saturation,
    count_polynomial,
    held_against,
)
from linkwise.report.recorded_operations import NODES
from linkwise.report.reduction_curve import CurvePoint, Study
from linkwise.report.spatial_arms import spatial_remark

CLOSE = 0.02
"""RMSE up to which a curve is said to describe the points."""
SHOWN = (1, 2, 3, 5, 10)
"""Degrees of freedom that a sentence reports."""
PAPER_DOF = 10
"""Most degrees of freedom to which the paper fitted its curve."""
PAPER_REDUNDANT = {5: 3, 10: 16}
"""Redundant terms for each kept one that the paper states, by degrees of freedom."""


def verdicts(result: Study) -> Iterator[str]:
    """Yield where the paper's claim holds, and where it is weaker or stronger, by the points."""
    yield _curve_verdict(result)
    for point in result.points:
        if point.dof in PAPER_REDUNDANT:
            yield _redundancy_verdict(point)
    if result.total is not None and result.kept is not None:
        yield _limit_verdict(result.total, result.kept)
    if result.uncombined:
        yield _convention_verdict(result)
    yield _operations_verdict(result.points[-1])
    if result.recorded:
        yield _graph_verdict(result)
        yield _nodes_verdict(result)
    if result.spatial:
        pairs = dict(zip(result.dof, result.uncombined, strict=False))
        last = result.points[-1]
        first = result.points[0] if result.dof[0] == 1 else None
        yield " ".join(spatial_remark(last.dof, last, pairs.get(last.dof), first))


def _nodes_verdict(result: Study) -> str:
    """Return the savings in the nodes that autograd keeps, in words."""
    told = [
        f"{pair.nodes.reduction:.2f} at {dof} DoF ({pair.nodes.total} and {pair.nodes.kept})"
        for dof, pair in zip(result.dof, result.recorded, strict=True)
        if dof in SHOWN or dof == result.dof[-1]
    ]
    return f"**Node by node**, {NODES}, y is {', '.join(told)}."


def _curve_verdict(result: Study) -> str:
    """Return a comparison of the paper's curve with the points it was fitted to, and with further points."""
    inside = [p for p in result.points if p.dof <= PAPER_DOF] or list(result.points)
    outside = result.points[len(inside) :]
    paper = held_against(PAPER_A, PAPER_RATE, [p.dof for p in inside], [p.reduction for p in inside])
    verdict = "Holds" if paper.rmse <= CLOSE else "Does not hold here"
    text = (
        f"**{verdict}: the curve.** {PAPER_A} (1 − exp(−{PAPER_RATE} n)) misses the counted points of "
        f"n = {inside[0].dof}..{inside[-1].dof} by at most {paper.largest:.4f} (RMSE {paper.rmse:.4f})"
    )
    if outside:
        text += f" and the further ones by up to {max(map(abs, result.paper.residuals[len(inside) :])):.4f}"
    if result.fitted is None:
        return text + "."
    return text + (
        f"; a free fit to all points, A = {result.fitted.a:.4f} and λ = {result.fitted.rate:.4f}, misses "
        f"them by at most {result.fitted.largest:.4f} (RMSE {result.fitted.rmse:.4f})"
        f"{_no_share(result.fitted)}."
    )


def _no_share(found: Saturation) -> str:
    """Return a remark on a fit with a limit above 1; "" for other fits."""
    return "" if found.is_share else ", but no more than all can be saved: an A above 1 tells of no limit"


def _redundancy_verdict(point: CurvePoint) -> str:
    stated, found = PAPER_REDUNDANT[point.dof], point.redundant_per_kept
    verdict = "Holds" if round(found) == stated else "Stronger" if found > stated else "Weaker"
    y = PAPER_A * (1 - exp(-PAPER_RATE * point.dof))
    return (
        f"**{verdict}: {point.dof} DoF.** {found:.1f} redundant terms for each kept one; "
        f"the paper says about {stated}, and its curve gives {y / (1 - y):.1f}."
    )


def _limit_verdict(total: CountPolynomial, kept: CountPolynomial) -> str:
    """Return a comparison of the exact limit with the paper's: its words say 1, its curve ends at A."""
    excess = total.degree - kept.degree
    counts = f"Both counts are polynomials in n (degrees {total.degree} and {kept.degree})"
    if excess <= 0:
        return (
            f"**Weaker: many DoF.** {counts}: y has a limit below 1, where the paper says that it tends to 1."
        )
    scale = float(kept.leading / total.leading)
    beyond = next((n for n in range(1, 1000) if 1 - kept(n) / total(n) > PAPER_A), None)
    passed = "" if beyond is None else f", which y passes at {beyond} DoF"
    return (
        f"**Holds: many DoF.** {counts}: 1 − y falls like {scale:.4g}/n^{excess}, and y tends to 1, as the "
        f"paper says. The exponential is a fit, not a law: it ends at A = {PAPER_A}{passed}."
    )


def _convention_verdict(result: Study) -> str:
    """Return a sentence on those of the paper's numbers that the other convention gives too."""
    pairs = dict(zip(result.dof, result.uncombined, strict=False))
    told = [
        f"{pairs[dof].redundant_per_kept:.1f} redundant terms for each kept one at {dof} DoF "
        f"(the paper: {stated})"
        for dof, stated in PAPER_REDUNDANT.items()
        if dof in pairs
    ]
    if result.uncombined_fit is not None:
        found = result.uncombined_fit
        paper = held_against(PAPER_A, PAPER_RATE, list(pairs), [pair.reduction for pair in pairs.values()])
        told.append(
            f"a free fit of A = {found.a:.4f} and λ = {found.rate:.4f}{_no_share(found)}; the paper's curve "
            f"misses these points by up to {paper.largest:.4f}"
        )
    last = max(pairs)
    return (
        f"**By another convention**, which leaves sin² + cos² as two terms: {pairs[last].reduction:.1%} of "
        f"{pairs[last].total} terms are not needed at {last} DoF"
        + "".join(f"; {text}" for text in told)
        + ". The paper does not say how it counted: that it was as above is inferred from its curve."
    )


def _operations_verdict(last: CurvePoint) -> str:
    verdict = "Weaker" if last.operations_reduction < last.reduction else "Stronger"
    return (
        f"**{verdict}: emitted code.** At {last.dof} DoF the part kept takes "
        f"{last.part.shared} operations, the product with q̈_1 among them, and the whole "
        f"{last.torque.shared}: "
        f"{last.operations_reduction:.1%} are saved, against {last.reduction:.1%} of the terms. "
        "Emitted code computes once what an expanded sum repeats; with nothing shared "
        f"{last.written_reduction:.1%} of the operations would be saved."
    )


def _graph_verdict(result: Study) -> str:
    """Return a sentence on the savings of autograd's recorded operations, and their limit."""
    last, dof = result.recorded[-1], result.dof[-1]
    verdict = "Weaker" if last.reduction < result.points[-1].reduction else "Stronger"
    text = (
        f"**{verdict}: autograd.** Of the {last.total} operations that autograd takes for τ_1 at {dof} DoF, "
        f"equal ones counted once, its q̈_1 part needs {last.kept}: {last.reduction:.1%} are saved, where "
        f"{result.points[-1].reduction:.1%} of the terms are"
    )
    # One joint differs: it has no velocity forces.
    pairs = [pair for n, pair in zip(result.dof, result.recorded, strict=True) if n > 1]
    total, kept = (count_polynomial([getattr(p, name) for p in pairs]) for name in ("total", "kept"))
    if total is None or kept is None or total.degree != kept.degree:
        return f"{text}."
    return (
        f"{text}; from 2 DoF on both counts are polynomials of degree {total.degree}, so that it tends to "
        f"{float(1 - kept.leading / total.leading):.1%}, and not to all."
    )
