"""The cost-reduction curve (Fig. 15): y(n) = 1 − kept(n)/total(n), over an arm's first n links."""

from dataclasses import dataclass

from linkwise.errors import LinkwiseError
from linkwise.progress import Progress
from linkwise.report.curve_fit import (
    PAPER_A,
    PAPER_RATE,
    CountPolynomial,
    Saturation,
    count_polynomial,
    fit,
    held_against,
)
from linkwise.report.expanded_torques import form_of, link_torques
from linkwise.report.laurent import BudgetExceededError
from linkwise.report.operations import NO_OPERATIONS, LinkOperations, Operations, link_operations, total_cost
from linkwise.report.recorded_operations import RecordedPair, recorded_operations
from linkwise.report.spatial_arms import is_spatial
from linkwise.report.term_count import RunningCount, TermPair, TermQuery
from linkwise.report.uncombined_terms import uncombined_terms
from linkwise.symbolic.system import RigidSystem, System

PAPER = TermQuery(joint=0, link=None, coordinate=0, order=2)
"""The paper's query: the terms of τ_1 that contain q̈_1."""


@dataclass(frozen=True)
class CurvePoint(TermPair):
    """The arm of the first `dof` links: cost of Σ_j τ_1j against that of its q̈_1 part alone."""

    dof: int
    torque: Operations
    part: Operations
    everything: Operations

    @property
    def operations_reduction(self) -> float:
        """Share of the emitted operations of τ_1 that need not be computed."""
        return _saved(self.part.shared, self.torque.shared)

    @property
    def written_reduction(self) -> float:
        """Share of operations of τ_1 that need not be computed, with shared expressions written out."""
        return _saved(self.part.written, self.torque.written)


def _saved(part: int, whole: int) -> float:
    """Return 1 − part/whole; 0 for a torque that takes no operation."""
    return 1.0 - part / whole if whole else 0.0


@dataclass(frozen=True)
class Study:
    """The curve of one arm, with fits. The polynomials also use points beyond the requested ones.

    uncombined: the points by the convention of `uncombined_terms`, as far as the budget reaches; none for
    energies that a user wrote
    recorded: operations that autograd takes, where these were requested
    spatial: whether the arm leaves a plane, unlike the paper's arms
    """

    robot: str
    form: str
    points: tuple[CurvePoint, ...]
    fitted: Saturation | None
    paper: Saturation
    total: CountPolynomial | None
    kept: CountPolynomial | None
    uncombined: tuple[TermPair, ...]
    uncombined_fit: Saturation | None
    recorded: tuple[RecordedPair, ...] = ()
    spatial: bool = False

    @property
    def dof(self) -> tuple[int, ...]:
        """Degrees of freedom of the points."""
        return tuple(point.dof for point in self.points)


def study(
    name: str,
    system: System,
    first: int,
    last: int,
    beyond: int,
    budget: int,
    progress: Progress,
    graphs: bool = False,
) -> Study:
    """Count the links of a serial arm, and report on first..last under `name`.

    Links are counted to `beyond` where possible. With `graphs`, which needs torch, operations that autograd
    takes are counted too.
    """
    every = curve(system, last, budget, progress, beyond)
    points = every[first - 1 : last]
    dof, y = [p.dof for p in points], [p.reduction for p in points]
    uncombined = (
        tuple(uncombined_terms(system, last, budget))[first - 1 :] if isinstance(system, RigidSystem) else ()
    )
    return Study(
        name,
        form_of(system),
        points,
        fit(dof, y),
        held_against(PAPER_A, PAPER_RATE, dof, y),
        count_polynomial([p.total for p in every]),
        count_polynomial([p.kept for p in every]),
        uncombined,
        fit(dof[: len(uncombined)], [pair.reduction for pair in uncombined]),
        tuple(recorded_operations(system, last, progress))[first - 1 :] if graphs else (),
        is_spatial(system, last),
    )


def curve(
    system: System, last: int, budget: int, progress: Progress, beyond: int = 0
) -> tuple[CurvePoint, ...]:
    """Return points for 1..last links, and to `beyond` as far as links and budget reach.

    Raises LinkwiseError for a tree, or where 1..last is beyond the links or the budget.

    A link's torques do not depend on any link after it: the arm of n links is the arm of n − 1 and one more.
    """
    most = max(last, min(beyond, len(system.links)))
    _require_serial(system, last, most)
    running = RunningCount(len(system.coordinates))
    costs: list[LinkOperations] = []
    everything = NO_OPERATIONS
    points: list[CurvePoint] = []
    links = link_operations(system, (0,), PAPER)
    try:
        for found, cost in zip(link_torques(system, (0,), budget, progress, most), links, strict=False):
            running.add(found.torques[0], found.variables)
            costs.append(cost)
            everything += cost.everything
            whole, part = total_cost(costs, 0, PAPER)
            total, kept = running.count.total, running.count.kept(PAPER)
            if not kept:
                raise LinkwiseError(
                    f"{system.name}: no term of τ_1 contains q̈_1; the curve needs a first link with inertia"
                )
            points.append(CurvePoint(total, kept, len(points) + 1, whole, part, everything))
    except BudgetExceededError as error:
        if len(points) >= last:
            return tuple(points)
        raise LinkwiseError(
            f"{system.name}: {len(points) + 1} links need more than {budget} terms; "
            f"ask for at most {len(points)}, or raise --budget"
        ) from error
    return tuple(points)


def _require_serial(system: System, last: int, most: int) -> None:
    if last > len(system.links):
        raise LinkwiseError(
            f"{system.name}: --dof reaches {last}, but {len(system.links)} links move; reduce it"
        )
    for j in range(most):
        if system.path(j) != tuple(range(j + 1)):
            raise LinkwiseError(
                f"{system.name}: link {system.link_names[j]!r} is not moved by joints 1..{j + 1}; "
                "the curve needs a serial arm with one moving link a joint"
            )
