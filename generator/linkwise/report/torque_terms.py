"""Terms of each partial torque, and those of them that one bucket needs."""

from dataclasses import dataclass

from linkwise.errors import LinkwiseError
from linkwise.package.share_word import share_word
from linkwise.progress import Progress
from linkwise.report.expanded_torques import form_of, link_torques
from linkwise.report.laurent import BudgetExceededError
from linkwise.report.operations import LinkOperations, Operations, link_operations, total_cost
from linkwise.report.term_count import RunningCount, TermCount, TermQuery
from linkwise.symbolic.system import EnergySystem, System


@dataclass(frozen=True)
class TorqueTerms:
    """Terms of τ_ij; `link` None is the sum over the links counted."""

    joint: int
    link: int | None
    count: TermCount
    kept: int

    @property
    def reduction(self) -> float | None:
        """Share of terms that need no computing, 1 − kept/total; None where the torque is 0."""
        return 1.0 - self.kept / self.count.total if self.count.total else None


@dataclass(frozen=True)
class TermsReport:
    """The report on one robot; the first `counted` of the links `wanted` fitted the budget.

    sums: operations of τ_i over all links, and of its part, by joint i; none when one link is requested
    """

    robot: str
    query: TermQuery
    form: str
    potential: str
    """Name of the terms without any motion."""
    joints: tuple[str, ...]
    links: tuple[str, ...]
    counted: int
    wanted: int
    budget: int
    rows: tuple[TorqueTerms, ...]
    operations: tuple[LinkOperations, ...]
    sums: dict[int, tuple[Operations, Operations]]

    @property
    def kept(self) -> str:
        """Kept terms, in words."""
        return str(self.query) if self.query.order else self.potential

    @property
    def complete(self) -> bool:
        """True if every requested link was counted."""
        return self.counted == self.wanted


def terms_report(
    system: System, query: TermQuery, budget: int, partial: bool, progress: Progress
) -> TermsReport:
    """Return counts of terms and operations; raise LinkwiseError for a robot beyond the budget.

    With `partial` the links that fit are reported, if at least one of them was requested.
    """
    _refuse_forces(system)
    wanted = len(system.links) if query.link is None else query.link + 1
    rows, counted = _rows(system, query, wanted, budget, progress)
    if counted < wanted and not (partial and rows):
        raise LinkwiseError(
            f"{system.name}: link {system.link_names[counted]!r} needs more than {budget} terms, "
            f"after {counted} of {wanted} links; raise --budget, or pass --partial to report on those"
        )
    joints = query.joints(len(system.coordinates))
    costs = tuple(link_operations(system, joints, query))
    return TermsReport(
        system.name,
        query,
        form_of(system),
        share_word(system.share_names),
        tuple(c.name for c in system.coordinates),
        system.link_names,
        counted,
        wanted,
        budget,
        rows,
        tuple(cost for cost in costs if query.link in (None, cost.link)),
        {i: total_cost(costs, i, query) for i in joints if query.link is None},
    )


def _refuse_forces(system: System) -> None:
    """Raise LinkwiseError for links whose torques are not those of a Lagrangian alone."""
    if not isinstance(system, EnergySystem):
        return
    if system.constraints:
        raise LinkwiseError(
            f"{system.name} has constraints, and terms are counted of free coordinates alone; leave them "
            "out, or choose coordinates without any"
        )
    for link in system.links:
        if not link.has_lagrangian or system.time is not None:
            what = "explicit time" if link.has_lagrangian else "dissipation or forces"
            raise LinkwiseError(
                f"{system.name}: link {link.name!r} has {what}, and terms are counted of energies alone; "
                "leave that out to count the others"
            )


def _rows(
    system: System, query: TermQuery, wanted: int, budget: int, progress: Progress
) -> tuple[tuple[TorqueTerms, ...], int]:
    """Return counts of each τ_ij and of the sums over j, and how many links fitted the budget."""
    n = len(system.coordinates)
    sums = {i: RunningCount(n) for i in query.joints(n)}
    rows: list[TorqueTerms] = []
    counted = 0
    try:
        for found in link_torques(system, tuple(sums), budget, progress, wanted):
            for i, running in sums.items():
                torque = found.torques.get(i)
                own = TermCount.none(n) if torque is None else running.add(torque, found.variables)
                if query.link in (None, found.link):
                    rows.append(_row(i, found.link, own, query))
            counted += 1
    except BudgetExceededError:
        pass  # the report says how many links were counted
    if query.link is None and rows:
        rows += [_row(i, None, running.count, query) for i, running in sums.items()]
    # τ_i1, τ_i2, …, then their sum, joint after joint.
    rows.sort(key=lambda row: (row.joint, wanted if row.link is None else row.link))
    return tuple(rows), counted


def _row(joint: int, link: int | None, count: TermCount, query: TermQuery) -> TorqueTerms:
    return TorqueTerms(joint, link, count, count.kept(query))
