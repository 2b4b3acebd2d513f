"""The table, in Markdown."""

from collections.abc import Iterable, Iterator, Sequence

from speed.control_steps import CONTROL
from speed.emitted import TYPES, Figure
from speed.results import Results
from speed.targets import Target, targets


def markdown(results: Results) -> str:
    """All sections."""
    parts = [
        ", ".join(f"{key} {value}" for key, value in results.machine.items()),
        "## Packages",
        table(PACKAGE_HEAD, packages(results)),
        "## Emitted C, nanoseconds a sample",
        table(
            ["robot", "type", "layout", "threads", *BATCHES, "of arithmetic", "of the limit"],
            emitted(results),
        ),
        limits_text(results),
        "## Control steps of the emitted C, nanoseconds",
        table(["robot", "step", "ns"], control_steps(results)),
        "## Calls from Python, nanoseconds a sample",
        table(["robot", "back end", "call", "type", "threads", *BATCHES], backends(results)),
        "## Peers, float64, one thread, nanoseconds a sample",
        table(PEER_HEAD, peers(results)),
        "## Targets",
        table(["target", "measured", "wanted", ""], (row(target) for target in targets(results))),
        *[f"Note: {note}" for note in results.notes],
    ]
    return "\n\n".join(parts)


def limits_text(results: Results) -> str:
    """Return the limits, in words, of which shares are shares."""
    mix = results.mix
    given = f"{mix.fused:.0%} fused operations and {mix.products:.0%} products" if mix else "no mix"
    return (
        f"Limits, one thread: {results.limits['flops']:.0f} GFlop/s in float64,"
        f" {results.limits['flopsf']:.0f} in float32, of instructions that are {given}, as in Panda's"
        " closed forms, the others being sums; memory: of writing the results past the cache or through it,"
        " whatever is faster. Shares of arithmetic at each batch, of the lower of the two at the largest."
    )


HISTORY = {
    "in the cache / arithmetic": "Panda, batch 1,024 / arithmetic limit",
    "Pinocchio / batch": "Panda, Pinocchio's full decomposition / batch 1,024",
    "CasADi / batch": "Panda, CasADi's C / batch 1,024",
    "Pinocchio / one": "Panda, Pinocchio's full decomposition / one sample",
    "large, of the limit": "Panda, float64, blocks, batch",
    "τ from Python / rnea": "Panda, native from Python, one sample, partial_torque",
    "propagation / rnea": "Panda, native from Python, one sample, propagation",
    "Pinocchio / 20 joints": "chain20, Pinocchio's full decomposition / batch 256",
    "autograd / torch": "Panda, batch 1,024, autograd",
}
"""Columns of docs/speed.md, and the targets that they show."""


def history(results: Results) -> str:
    """A line for docs/speed.md: when, what, on which machine, and ratios."""
    machine = results.machine
    start = [f"{machine[key]}" for key in ("date", "linkwise")]
    shown = []
    for begin in HISTORY.values():
        measured = next(t.measured for t in targets(results) if t.what.startswith(begin))
        shown.append("-" if measured is None else f"{measured:,.3g}")
    return "| " + " | ".join([*start, f"{machine['processor']}, {machine['vectors']}", *shown]) + " |"


PACKAGE_HEAD = [
    "robot",
    "joints",
    "outputs",
    "operations",
    "generate s",
    "compile double s",
    "float s",
    "code kB",
]
PEER_HEAD = [
    "robot", "Pinocchio through", "rnea", "its τ_ij", "its full decomposition", "CasADi C", "ours, one",
    "ours, 1,024", "Pinocchio/ours", "one sample", "largest difference",
]  # fmt: skip
BATCHES = ["1", "256", "1,024", "largest"]


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Columns as wide as their widest cell."""
    cells = [list(head), *map(list, rows)]
    widths = [max(len(line[c]) for line in cells) for c in range(len(head))]
    lines = [
        "| " + " | ".join(t.ljust(w) for t, w in zip(line, widths, strict=True)) + " |" for line in cells
    ]
    return "\n".join([lines[0], "|" + "|".join("-" * (w + 2) for w in widths) + "|", *lines[1:]])


def packages(results: Results) -> Iterator[list[str]]:
    """One row a robot."""
    for p in results.packages:
        compiled = [f"{took:.1f}" for took in p["compile_seconds"].values()]
        counts = [f"{p[key]:,}" for key in ("joints", "outputs", "operations")]
        yield [
            p["robot"],
            *counts,
            f"{p['generate_seconds']:.1f}",
            *compiled,
            f"{p['code_bytes'] / 1000:,.0f}",
        ]


def emitted(results: Results) -> Iterator[list[str]]:
    """One row a robot, number type, layout and number of threads."""
    for p in results.packages:
        for dtype in TYPES:
            for layout in ("rows", "blocks"):
                for threads in (1, 2):
                    by_batch = results.find(p["robot"], "C", dtype, layout, threads)
                    key = (p["robot"], "C", dtype, layout)
                    figures = [Figure(*key, b, threads, ns) for b, ns in by_batch.items() if b > 1]
                    if figures:
                        shares = [share(results.arithmetic(f), f.ns) for f in figures]
                        whole = share(results.limit(figures[-1]), figures[-1].ns) if threads == 1 else ""
                        head = [p["robot"], dtype, layout, str(threads)]
                        yield [*head, *cells(by_batch), ", ".join(shares), whole]


def share(least: float | None, ns: float) -> str:
    """Return the part of a time that is needed at least, in percent."""
    return f"{least / ns:.0%}" if least else "-"


def control_steps(results: Results) -> Iterator[list[str]]:
    """One row a robot and a kind of step."""
    for f in results.figures:
        if f.call.startswith(CONTROL):
            yield [f.robot, f.call.removeprefix(CONTROL), number(f.ns)]


def backends(results: Results) -> Iterator[list[str]]:
    """One row a robot, back end, call, number type and number of threads; then Pinocchio's own calls."""
    seen = dict.fromkeys(
        (f.robot, f.through, f.call, f.dtype, f.threads) for f in results.figures if f.through != "C"
    )
    for robot, backend, call, dtype, threads in seen:
        by_batch = results.find(robot, backend, dtype, "rows", threads, call)
        yield [robot, backend, call, dtype, str(threads), *cells(by_batch)]
    for robot, calls in results.from_python.items():
        for call, ns in calls.items():
            yield [robot, "Pinocchio", call, "float64", "1", *cells({1: ns})]


def cells(by_batch: dict[int, float]) -> list[str]:
    """Figures for one sample, 256, 1,024, and more; the last names its batch if it isn't 65,536."""
    more = max((b for b in by_batch if b > 1024), default=0)
    return [
        *(number(by_batch.get(batch)) for batch in (1, 256, 1024)),
        number(by_batch.get(more)) + (f" ({more:,})" if more not in (0, 65536) else ""),
    ]


def peers(results: Results) -> Iterator[list[str]]:
    """One row a robot."""
    for p in results.packages:
        robot = p["robot"]
        one = results.find(robot, "C", "float64", "rows").get(1)
        batch = results.find(robot, "C", "float64", "blocks").get(1024)
        pin, casadi = results.pinocchio.get(robot), results.casadi.get(robot)
        whole = pin.decomposition if pin else None
        yield [
            robot, pin.how if pin else "-", number(pin.rnea if pin else None),
            number(pin.regressor if pin else None), number(whole),
            number(casadi.ns if casadi else None), number(one), number(batch),
            times(whole, batch), times(whole, one),
            f"{max(x.difference for x in (pin, casadi) if x):.1e}" if pin or casadi else "-",
        ]  # fmt: skip


def number(ns: float | None) -> str:
    """Nanoseconds for reading: three digits at least."""
    if ns is None:
        return "-"
    return f"{ns:,.0f}" if ns >= 100 else f"{ns:.1f}"


def times(theirs: float | None, ours: float | None) -> str:
    """Return how many times faster we are."""
    return f"{theirs / ours:,.0f}×" if theirs and ours else "-"


def row(target: Target) -> list[str]:
    """One target as a row."""
    sign = "≤" if target.at_most else "≥"
    measured = "-" if target.measured is None else f"{target.measured:,.3g}"
    verdict = "not measured" if target.met is None else "met" if target.met else "NOT MET"
    return [target.what, measured, f"{sign} {target.wanted:,g}", verdict]
