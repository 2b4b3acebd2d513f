"""The cost-reduction curve (Fig. 15): y(n) = 1 − kept(n)/total(n), over an arm's first n links."""

from dataclasses import dataclass

from linkwise.errors import LinkwiseError
from linkwise.progress import Progress
from linkwise.report.laurent import BudgetExceededError
from linkwise.report.operations import NO_OPERATIONS, Operations, link_operations
from linkwise.report.question import Question
from linkwise.report.survey import RunningCount, link_torques
from linkwise.symbolic.system import System

PAPER = Question(joint=0, link=None, coordinate=0, order=2)
"""The paper's: from τ_1, what contains q̈_1."""


@dataclass(frozen=True)
class Point:
    """The arm of the first `dof` links: Σ_j τ_1j against what its q̈_1 part alone takes."""

    dof: int
    total: int
    kept: int
    torque: Operations
    bucket: Operations
    everything: Operations

    @property
    def reduction(self) -> float:
        """Share of terms that need no computing."""
        return 1.0 - self.kept / self.total

    @property
    def redundant_per_kept(self) -> float:
        """Terms computed in vain for each one that is wanted."""
        return (self.total - self.kept) / self.kept

    @property
    def operations_reduction(self) -> float:
        """Share of the emitted operations of τ_1 that need no computing."""
        return _saved(self.bucket.shared, self.torque.shared)

    @property
    def written_reduction(self) -> float:
        """The same with every shared expression written out wherever it is used."""
        return _saved(self.bucket.written, self.torque.written)


def _saved(part: int, whole: int) -> float:
    """1 − part/whole; nothing is saved of a torque that takes no operation."""
    return 1.0 - part / whole if whole else 0.0


def curve(system: System, most: int, budget: int, progress: Progress) -> tuple[Point, ...]:
    """Points for 1..most links; raises LinkwiseError for a tree, or beyond the budget.

    A link's torques depend on nothing behind it: the arm of n links is that of n − 1 and one more.
    """
    _require_serial(system, most)
    running = RunningCount(len(system.coordinates))
    torque = bucket = everything = NO_OPERATIONS
    points: list[Point] = []
    costs = link_operations(system, (0,), PAPER)
    try:
        for found, cost in zip(link_torques(system, (0,), budget, progress, most), costs, strict=False):
            running.add(found.torques[0], found.variables)
            torque, bucket = torque + cost.torque[0], bucket + cost.bucket[0]
            everything += cost.everything
            count = running.count
            points.append(Point(len(points) + 1, count.total, count.kept(2, 0), torque, bucket, everything))
    except BudgetExceededError as error:
        raise LinkwiseError(
            f"{system.name}: {len(points) + 1} links need more than {budget} terms; "
            f"ask for at most {len(points)}, or raise --budget"
        ) from error
    return tuple(points)


def _require_serial(system: System, most: int) -> None:
    if most > len(system.links):
        raise LinkwiseError(
            f"{system.name}: --dof reaches {most}, but {len(system.links)} links move; reduce it"
        )
    for j in range(most):
        if system.path(j) != tuple(range(j + 1)):
            raise LinkwiseError(
                f"{system.name}: link {system.links[j].name!r} is not moved by joints 1..{j + 1}; "
                "the curve needs a serial arm with one moving link a joint"
            )
