"""The cost-reduction study of one arm: curve, fits, exact polynomials, verdicts on the paper."""

from collections.abc import Iterator
from dataclasses import dataclass

from linkwise.progress import Progress
from linkwise.report.fit import PAPER_A, PAPER_RATE, Saturation, fit, held_against
from linkwise.report.polynomial import CountPolynomial, count_polynomial
from linkwise.report.reduction import Point, curve
from linkwise.report.survey import form_of
from linkwise.symbolic.system import System

CLOSE = 0.02
"""RMSE up to which a curve is said to describe the points."""
PAPER_DOF = 10
"""Most degrees of freedom that the paper fitted its curve to."""
PAPER_REDUNDANT = {5: 3, 10: 16}
"""Redundant terms for each kept one that the paper states, by degrees of freedom."""


@dataclass(frozen=True)
class Study:
    """points: those asked for; the polynomials rest on further ones too, up to `checked`."""

    robot: str
    form: str
    points: tuple[Point, ...]
    fitted: Saturation | None
    paper: Saturation
    total: CountPolynomial | None
    kept: CountPolynomial | None

    @property
    def dof(self) -> tuple[int, ...]:
        """Degrees of freedom of the points."""
        return tuple(point.dof for point in self.points)


def study(
    name: str, system: System, first: int, last: int, beyond: int, budget: int, progress: Progress
) -> Study:
    """Count the links of a serial arm, to `beyond` where possible, and report on first..last under `name`."""
    every = curve(system, last, budget, progress, beyond)
    points = every[first - 1 : last]
    dof, y = [p.dof for p in points], [p.reduction for p in points]
    return Study(
        name,
        form_of(system),
        points,
        fit(dof, y),
        held_against(PAPER_A, PAPER_RATE, dof, y),
        count_polynomial([p.total for p in every]),
        count_polynomial([p.kept for p in every]),
    )


def verdicts(result: Study) -> Iterator[str]:
    """Say where the paper's claim holds, and where it is weaker or stronger, by the points."""
    yield _curve_verdict(result)
    for point in result.points:
        if point.dof in PAPER_REDUNDANT:
            yield _redundancy_verdict(point)
    if result.total is not None and result.kept is not None:
        yield _long_run(result.total, result.kept)
    yield _operations_verdict(result.points[-1])


def _curve_verdict(result: Study) -> str:
    """Hold the paper's curve against the joints it was fitted to, and say where it is further out."""
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
        f"; the free fit A = {result.fitted.a:.4f}, λ = {result.fitted.rate:.4f} over all by at most "
        f"{result.fitted.largest:.4f} (RMSE {result.fitted.rmse:.4f})."
    )


def _redundancy_verdict(point: Point) -> str:
    stated, found = PAPER_REDUNDANT[point.dof], point.redundant_per_kept
    verdict = "Holds" if round(found) == stated else "Stronger" if found > stated else "Weaker"
    return (
        f"**{verdict}: {point.dof} DoF.** {found:.1f} redundant terms for each kept one; "
        f"the paper says about {stated}."
    )


def _long_run(total: CountPolynomial, kept: CountPolynomial) -> str:
    """Compare the limit of the exact curve with that of an exponential below one."""
    excess = total.degree - kept.degree
    beyond = next((n for n in range(1, 1000) if 1 - kept(n) / total(n) > PAPER_A), None)
    text = (
        f"**{'Stronger' if excess > 0 else 'Weaker'} in the long run.** Both counts are "
        f"polynomials (degrees {total.degree} and {kept.degree}), so the exponential is a fit and "
        "no law: "
    )
    if excess <= 0:
        return text + "the reduction has a limit below one."
    scale = kept.leading / total.leading
    text += f"1 − y falls like {float(scale):.4g}/n^{excess} and y tends to 1"
    return text + (f", past the paper's A = {PAPER_A} from {beyond} DoF on." if beyond else ".")


def _operations_verdict(last: Point) -> str:
    verdict = "Weaker" if last.operations_reduction < last.reduction else "Stronger"
    return (
        f"**{verdict} in emitted code.** At {last.dof} DoF the part kept takes "
        f"{last.part.shared} operations, the product with q̈_1 among them, and the whole "
        f"{last.torque.shared}: "
        f"{last.operations_reduction:.1%} are saved, against {last.reduction:.1%} of the terms. "
        "Emitted code computes once what an expanded sum repeats; with nothing shared "
        f"{last.written_reduction:.1%} of the operations would be saved."
    )
