"""How every plot looks: legible on paper, in grey and to the colour-blind; the same on each run."""

import io
from collections.abc import Callable
from typing import Any

from linkwise.report.extras import report_extra

BLUE, VERMILION, GREEN, PURPLE, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9"
"""Okabe and Ito's colours; lines differ in dash and marker as well."""
INK, PALE = "#222222", "#D8D8D8"

SETTINGS = {
    "svg.hashsalt": "linkwise",
    "svg.fonttype": "path",
    "font.family": "DejaVu Sans",
    "font.size": 9.0,
    "axes.edgecolor": INK,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": PALE,
    "grid.linewidth": 0.6,
    "legend.frameon": False,
    "legend.handlelength": 4.5,
    "lines.linewidth": 1.6,
    "figure.dpi": 100,
}


def images(name: str, draw: Callable[[Any], None], size: tuple[float, float]) -> dict[str, bytes]:
    """Return `name`.svg and `name`.png of what `draw` puts on a figure of `size` in inches."""
    matplotlib = report_extra("matplotlib")
    report_extra("matplotlib.figure")
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(SETTINGS)
        figure = matplotlib.figure.Figure(figsize=size, layout="constrained")
        draw(figure)
        return {
            f"{name}.svg": _saved(figure, format="svg", metadata={"Date": None, "Creator": None}),
            f"{name}.png": _saved(figure, format="png", dpi=200, metadata={"Software": None}),
        }


def _saved(figure: Any, **options: Any) -> bytes:
    out = io.BytesIO()
    figure.savefig(out, **options)
    return out.getvalue()
