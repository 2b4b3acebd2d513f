"""The plots of the reports."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from linkwise.report import style
from linkwise.report.extras import report_extra
from linkwise.report.fit import Saturation
from linkwise.report.study import Study
from linkwise.report.terms import TermsReport

STEPS = 200
"""Points of a drawn curve."""
DARKEST = 0.42
"""Shade of the largest count, on which dark figures still read well."""


@dataclass(frozen=True)
class Reading:
    """One line of the comparison: reduction by degrees of freedom, in things of one kind."""

    kind: str
    label: str
    dof: tuple[int, ...]
    reduction: tuple[float, ...]
    color: str
    marker: str
    dash: str | tuple[int, tuple[int, int]]


def reduction_images(result: Study) -> dict[str, bytes]:
    """Fig. 15: counted points, the fit and the paper's curve, with what each curve misses below."""
    return style.images("reduction", lambda figure: _reduction(figure, result), (6.3, 4.9))


def _reduction(figure: Any, result: Study) -> None:
    above, below = figure.subplots(2, 1, sharex=True, height_ratios=(3, 1))
    dof, y = result.dof, [p.reduction for p in result.points]
    curves: list[tuple[Saturation, str, str, str, str]] = [
        (result.paper, "paper", style.VERMILION, "--", "s")
    ]
    if result.fitted is not None:
        curves.append((result.fitted, "fit", style.GREEN, "-", "^"))
    n = [dof[0] + (dof[-1] - dof[0]) * step / STEPS for step in range(STEPS + 1)]
    for curve, name, color, dash, marker in curves:
        label = f"{name}: {curve.a:.3g} (1 − exp(−{curve.rate:.3g} n)),  RMSE {curve.rmse:.4f}"
        above.plot(n, [curve(x) for x in n], color=color, linestyle=dash, label=label)
        below.plot(dof, curve.residuals, color=color, linestyle=dash, marker=marker, markersize=4)
    above.plot(
        dof,
        y,
        "o",
        color=style.BLUE,
        markersize=6,
        markeredgecolor="white",
        label="counted terms",
        zorder=3,
    )
    above.set_ylabel("reduction rate  1 − kept / total")
    above.set_ylim(-0.02, 1.02)
    above.legend(loc="lower right")
    above.set_title(f"{result.robot}: terms of τ₁ that the part with q̈₁ does not need", loc="left")
    below.margins(y=0.15)
    below.axhline(0.0, color=style.INK, linewidth=0.8)
    below.set_ylabel("counted\n− curve")
    _whole_numbers(below, dof)


def readings_images(name: str, robot: str, readings: Sequence[Reading]) -> dict[str, bytes]:
    """Draw the same question asked of terms, of operations and of seconds."""
    return style.images(name, lambda figure: _readings(figure, robot, readings), (6.3, 4.0))


def _readings(figure: Any, robot: str, readings: Sequence[Reading]) -> None:
    axes = figure.subplots()
    for reading in readings:
        axes.plot(
            reading.dof,
            reading.reduction,
            color=reading.color,
            marker=reading.marker,
            linestyle=reading.dash,
            markersize=5.5,
            markeredgecolor="white",
            label=reading.label,
        )
    axes.set_ylabel("saved by the q̈₁ part of τ₁ alone")
    axes.set_ylim(min(0.0, *(min(r.reduction) - 0.05 for r in readings)), 1.02)
    axes.yaxis.set_major_formatter(lambda value, _: f"{100 * value:.0f} %")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.16), ncols=2)
    axes.set_title(f"{robot}: one question read in {_listed([r.kind for r in readings])}", loc="left")
    _whole_numbers(axes, readings[0].dof)


def _listed(kinds: Sequence[str]) -> str:
    *before, last = dict.fromkeys(kinds)
    return f"{', '.join(before)} and {last}" if before else last


def _whole_numbers(axes: Any, dof: Sequence[int]) -> None:
    step = 1 if len(dof) <= 15 else 5
    axes.set_xticks([n for n in dof if step == 1 or n % step == 0 or n == 1])
    axes.set_xlabel("degrees of freedom  n")


def terms_images(report: TermsReport) -> dict[str, bytes]:
    """Terms of each τ_ij as a table of shades: joints down, links across, kept in brackets."""
    rows = len({row.joint for row in report.rows})
    columns = len({row.link for row in report.rows})
    size = max(4.2, 1.2 + 0.95 * columns), max(1.7, 1.0 + 0.62 * rows)
    return style.images("terms", lambda figure: _terms(figure, report), size)


def _terms(figure: Any, report: TermsReport) -> None:
    axes = figure.subplots()
    joints = sorted({row.joint for row in report.rows})
    links = sorted({row.link for row in report.rows if row.link is not None})
    columns: list[int | None] = [*links, *([None] if len(links) > 1 else [])]
    darkest = max(math.log1p(row.count.total) for row in report.rows) or 1.0
    for row in report.rows:
        if row.link not in columns:
            continue
        x, y = columns.index(row.link), joints.index(row.joint)
        shade = DARKEST * math.log1p(row.count.total) / darkest
        axes.add_patch(_square(x, y, shade, row.link is None))
        if row.count.total:
            axes.text(x, y - 0.13, f"{row.count.total:,}", ha="center", va="center")
            axes.text(x, y + 0.2, f"({row.kept:,})", ha="center", va="center", fontsize=7.5)
    axes.set_xlim(-0.5, len(columns) - 0.5)
    axes.set_ylim(len(joints) - 0.5, -0.5)
    axes.set_xticks(range(len(columns)), ["all" if j is None else f"link {j + 1}" for j in columns])
    axes.set_yticks(range(len(joints)), [f"joint {i + 1}" for i in joints])
    axes.grid(visible=False)
    axes.tick_params(length=0)
    axes.spines[:].set_visible(False)
    axes.set_title(f"{report.robot}: terms of $τ_{{ij}}$ (in brackets: {report.question})", loc="left")


def _square(x: int, y: int, shade: float, is_sum: bool) -> Any:
    patches = report_extra("matplotlib.patches")
    edge = style.INK if is_sum else "white"
    return patches.Rectangle(
        (x - 0.46, y - 0.46), 0.92, 0.92, facecolor=_blue(shade), edgecolor=edge, linewidth=0.8
    )


def _blue(shade: float) -> tuple[float, float, float]:
    """White at 0 to a dark blue at 1; its lightness alone tells the number."""
    red, green, blue = 1.0 - shade, 1.0 - 0.8 * shade, 1.0 - 0.45 * shade
    return red, green, blue
