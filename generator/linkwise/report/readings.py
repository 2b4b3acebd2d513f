"""Three readings of one question: what is saved in terms, in operations and in seconds."""

from collections.abc import Sequence

from linkwise.report import style
from linkwise.report.plots import Reading
from linkwise.report.seconds import Timing
from linkwise.report.study import Study

LOOKS = {
    "closed form": ("seconds, closed form", style.GREEN, "^", "-."),
    "autograd": ("seconds, autograd", style.PURPLE, "D", ":"),
}


def readings(result: Study, timings: Sequence[Timing] = ()) -> tuple[Reading, ...]:
    """Lines of the comparison; the measured ones only where there are timings."""
    points, dof = result.points, result.dof
    counted = (
        Reading(
            "terms", "terms, as in the paper", dof, tuple(p.reduction for p in points), style.BLUE, "o", "-"
        ),
        Reading(
            "operations",
            "operations, nothing shared",
            dof,
            tuple(p.written_reduction for p in points),
            style.SKY,
            "v",
            (0, (5, 1)),
        ),
        Reading(
            "operations",
            "operations as emitted",
            dof,
            tuple(p.operations_reduction for p in points),
            style.VERMILION,
            "s",
            "--",
        ),
    )
    return (*counted, *(_measured(timings, method) for method in LOOKS if timings))


def _measured(timings: Sequence[Timing], method: str) -> Reading:
    label, color, marker, dash = LOOKS[method]
    chosen = [t for t in timings if t.method == method]
    return Reading(
        "seconds",
        label,
        tuple(t.dof for t in chosen),
        tuple(t.reduction for t in chosen),
        color,
        marker,
        dash,
    )
