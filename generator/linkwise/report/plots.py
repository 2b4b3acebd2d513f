"""The plots of the reports."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from linkwise.extras import extra
from linkwise.plotstyle import BLUE, BROWN, GREEN, INK, PURPLE, SKY, VERMILION, drawn, saved, styled
from linkwise.report.curve_fit import Saturation
from linkwise.report.reduction_curve import Study
from linkwise.report.seconds import METHODS, Timing
from linkwise.report.torque_terms import TermsReport, TorqueTerms

STEPS = 200
"""Points of a drawn curve."""
DARKEST = 0.42
"""Shade of the largest count, on which dark figures are still legible."""
DPI, MOST_PIXELS = 200, 60_000
"""Resolution of a plot, lowered where its longer side would have more pixels than matplotlib can draw."""


def _images(name: str, draw: Callable[[Any], None], size: tuple[float, float]) -> dict[str, bytes]:
    """Return `name`.svg and `name`.png of what `draw` puts on a figure of `size` in inches."""
    with styled():
        figure = extra("matplotlib.figure").Figure(figsize=size, layout="constrained")
        draw(figure)
        dpi = min(DPI, int(MOST_PIXELS / max(size)))
        return {f"{name}.{kind}": saved(figure, kind, dpi) for kind in ("svg", "png")}


def reduction_images(result: Study) -> dict[str, bytes]:
    """Return Fig. 15: counted points, the fit and the paper's curve, with the residuals of each below."""
    return _images("reduction", lambda figure: _draw_reduction(figure, result), (6.3, 4.9))


def _draw_reduction(figure: Any, result: Study) -> None:
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    dof, y = result.dof, [p.reduction for p in result.points]
    curves: list[tuple[Saturation, str, str, str, str]] = [(result.paper, "paper", VERMILION, "--", "s")]
    if result.fitted is not None:
        curves.append((result.fitted, "fit", GREEN, "-", "^"))
    n = [dof[0] + (dof[-1] - dof[0]) * step / STEPS for step in range(STEPS + 1)]
    for curve, name, color, dash, marker in curves:
        label = f"{name}: {curve.a:.3g} (1 − exp(−{curve.rate:.3g} n)),  RMSE {curve.rmse:.4f}"
        above.plot(n, [curve(x) for x in n], color=color, linestyle=dash, label=label)
        below.plot(dof, curve.residuals, color=color, linestyle=dash, marker=marker, markersize=4)
    points = {"markersize": 6, "markeredgecolor": "white", "zorder": 3}
    above.plot(dof, y, "o", color=BLUE, label="counted terms", **points)
    above.set_ylabel("reduction rate  1 − kept / total")
    above.set_ylim(-0.02, 1.02)
    above.legend(loc="lower right")
    above.set_title(f"{drawn(result.robot)}: terms of τ₁ that the part with q̈₁ does not need")
    below.margins(y=0.15)
    below.axhline(0.0, color=INK, linewidth=0.8)
    below.set_ylabel("counted\n− curve")
    _whole_numbers(below, dof)


def _whole_numbers(axes: Any, dof: Sequence[int]) -> None:
    step = 1 if len(dof) <= 15 else 5
    axes.set_xticks([n for n in dof if step == 1 or n % step == 0 or n == 1])
    axes.set_xlabel("degrees of freedom  n")


@dataclass(frozen=True)
class SavingsLine:
    """Saving of the q̈_1 part of τ_1, by degrees of freedom; `kind` is terms, operations or seconds."""

    kind: str
    label: str
    dof: tuple[int, ...]
    reduction: tuple[float, ...]
    color: str
    marker: str
    dash: str | tuple[int, tuple[int, int]]


def savings_lines(result: Study, timings: Sequence[Timing] = ()) -> tuple[SavingsLine, ...]:
    """Return the lines of the comparison; measured lines only where there are timings."""
    points, dof = result.points, result.dof
    terms = tuple(p.reduction for p in points)
    written = tuple(p.written_reduction for p in points)
    emitted = tuple(p.operations_reduction for p in points)
    long = (0, (5, 1))
    pairs = tuple(pair.reduction for pair in result.uncombined)
    lines = [
        SavingsLine("terms", "terms, sin² + cos² = 1", dof, terms, BLUE, "o", "-"),
        SavingsLine("operations", "operations, nothing shared", dof, written, SKY, "v", long),
        SavingsLine("operations", "operations as emitted", dof, emitted, VERMILION, "s", "--"),
    ]
    if pairs:
        label = "terms, sin² + cos² left"
        lines.insert(0, SavingsLine("terms", label, dof[: len(pairs)], pairs, BROWN, "P", (0, (2, 1))))
    if result.recorded:
        found = tuple(pair.reduction for pair in result.recorded)
        lines.append(
            SavingsLine(
                "operations", "operations of autograd, equal ones once", dof, found, INK, "X", (0, (3, 1))
            )
        )
    for method, look in zip(METHODS, ((GREEN, "^", "-."), (PURPLE, "D", ":")), strict=True):
        chosen = [t for t in timings if t.method == method]
        if chosen:
            n, y = tuple(t.dof for t in chosen), tuple(t.reduction for t in chosen)
            lines.append(SavingsLine("seconds", f"seconds, {method}", n, y, *look))
    return tuple(lines)


def savings_images(name: str, robot: str, lines: Sequence[SavingsLine]) -> dict[str, bytes]:
    """Draw the savings in terms, in operations and in seconds; return the images as files called `name`."""
    return _images(name, lambda figure: draw_savings(figure, robot, lines), (6.3, 4.0))


def draw_savings(figure: Any, robot: str, lines: Sequence[SavingsLine]) -> None:
    """Draw the comparison on an empty figure."""
    axes = figure.subplots()
    for line in lines:
        look = {"color": line.color, "marker": line.marker, "linestyle": line.dash, "label": line.label}
        axes.plot(line.dof, line.reduction, markersize=5.5, markeredgecolor="white", **look)
    axes.set_ylabel("saved by the q̈₁ part of τ₁ alone")
    axes.set_ylim(min(0.0, *(min(line.reduction) - 0.05 for line in lines)), 1.02)
    axes.yaxis.set_major_formatter(lambda value, _: f"{100 * value:.0f} %")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
    *before, last = dict.fromkeys(line.kind for line in lines)
    axes.set_title(f"{drawn(robot)}: savings in {', '.join(before)} and {last}")
    _whole_numbers(axes, lines[0].dof)


def terms_images(report: TermsReport) -> dict[str, bytes]:
    """Return the terms of each τ_ij as a table of shades: joints down, links across, kept in brackets."""
    rows = len({row.joint for row in report.rows})
    columns = len({row.link for row in report.rows})
    size = max(4.2, 1.2 + 0.95 * columns), max(1.9, 1.2 + 0.62 * rows)
    return _images("terms", lambda figure: _draw_terms(figure, report), size)


def _draw_terms(figure: Any, report: TermsReport) -> None:
    axes = figure.subplots()
    joints = sorted({row.joint for row in report.rows})
    links = sorted({row.link for row in report.rows if row.link is not None})
    columns: list[int | None] = [*links, *([None] if len(links) > 1 else [])]
    darkest = max(math.log1p(row.count.total) for row in report.rows) or 1.0
    for row in report.rows:
        if row.link in columns:
            shade = DARKEST * math.log1p(row.count.total) / darkest
            _draw_cell(axes, columns.index(row.link), joints.index(row.joint), row, shade)
    axes.set_xlim(-0.5, len(columns) - 0.5)
    axes.set_ylim(len(joints) - 0.5, -0.5)
    axes.set_xticks(range(len(columns)), ["all" if j is None else f"link {j + 1}" for j in columns])
    axes.set_yticks(range(len(joints)), [f"joint {i + 1}" for i in joints])
    axes.grid(visible=False)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set_title(f"{drawn(report.robot)}: terms of τᵢⱼ\nin brackets: those for the {report.kept}")


def _draw_cell(axes: Any, x: int, y: int, row: TorqueTerms, shade: float) -> None:
    """Draw one count on its shade, and the kept terms in brackets below; a sum over links gets a frame."""
    edge = INK if row.link is None else "white"
    # White at shade 0 to a dark blue at 1; its lightness alone shows the number.
    blue = 1.0 - shade, 1.0 - 0.8 * shade, 1.0 - 0.45 * shade
    place = (x - 0.46, y - 0.46), 0.92, 0.92
    axes.add_patch(
        extra("matplotlib.patches").Rectangle(*place, facecolor=blue, edgecolor=edge, linewidth=0.8)
    )
    if row.count.total:
        axes.text(x, y - 0.13, f"{row.count.total:,}", ha="center", va="center")
        axes.text(x, y + 0.2, f"({row.kept:,})", ha="center", va="center", fontsize=7.5)
