"""Curves as they are drawn: for long movements, the least and the greatest value of each piece."""

import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from linkwise.analysis.joint_causes import largest_first
from linkwise.analysis.result import AnalysisResult
from linkwise.arrays import Array
from linkwise.extras import extra
from linkwise.plotstyle import drawn

if TYPE_CHECKING:
    from matplotlib.figure import Figure

PAGE = 180 / 25.4
"""Usual width of a figure in inches: that of a journal's page, so that letters are printed as they are."""
LETTERS = 16.5
"""Letters of a note that fit in an inch."""
PIECES = 1500
"""Most pieces of a figure's curve, about a pixel each."""


@dataclass(frozen=True, eq=False)
class DrawnCurves:
    """Points of curves: the least and the greatest of each piece, or all samples of short movements."""

    time: Array
    """Times (curves, points) in s, ascending."""
    values: Array
    """Values (curves, points)."""
    middle: Array
    """Middle of each piece, (pieces,) in s."""
    least: Array
    """Least value of each piece, (curves, pieces)."""
    greatest: Array
    """Greatest value of each piece, (curves, pieces)."""

    def only(self, rows: slice) -> "DrawnCurves":
        """Return some of the curves."""
        return DrawnCurves(
            self.time[rows], self.values[rows], self.middle, self.least[rows], self.greatest[rows]
        )


def piece_size(total: int, pieces: int) -> int:
    """Return the number of samples in a piece, 1 where every sample is drawn."""
    return 1 if total <= 2 * pieces else -(-total // pieces)


def drawn_curves(
    result: AnalysisResult, curves: Callable[[AnalysisResult], Array], pieces: int = PIECES
) -> DrawnCurves:
    """Return curves (curves, S) of every part of the result, thinned to `pieces` pieces if long."""
    size = piece_size(result.total, pieces)
    made = []
    time, values = np.empty(0), np.empty((0, 0))
    for part in result.parts():
        found = curves(part)
        time = np.concatenate([time, part.time])
        values = np.concatenate([values, found], axis=1) if values.shape[1] else found
        whole = len(time) // size * size
        head = time[:whole], values[:, :whole]
        made.append(_whole(*head) if size == 1 else _thinned(*head, size))
        time, values = time[whole:].copy(), values[:, whole:].copy()
    if len(time):
        made.append(_thinned(time, values, len(time)))
    fields = zip(*made, strict=True)
    return DrawnCurves(*(np.concatenate(field, axis=-1) for field in fields))


def _whole(time: Array, values: Array) -> tuple[Array, Array, Array, Array, Array]:
    """Return the fields of `DrawnCurves` with every sample."""
    return np.broadcast_to(time, values.shape), values, time, values, values


def _thinned(time: Array, values: Array, size: int) -> tuple[Array, Array, Array, Array, Array]:
    """Return the fields of `DrawnCurves` with the least and greatest value in pieces of `size` samples."""
    pieces = values.reshape(len(values), -1, size)
    at = np.sort(np.stack([pieces.argmin(axis=-1), pieces.argmax(axis=-1)], axis=-1), axis=-1)
    points = np.take_along_axis(pieces, at, axis=-1).reshape(len(values), -1)
    place = (at + size * np.arange(pieces.shape[1])[:, None]).reshape(len(values), -1)
    middle = time.reshape(-1, size).mean(axis=-1)
    return time[place], points, middle, pieces.min(axis=-1), pieces.max(axis=-1)


def new_figure(height: float, width: float = PAGE) -> "Figure":
    """Return a matplotlib figure of this size in inches, which places its panels itself."""
    figure: Figure = extra("matplotlib.figure").Figure(figsize=(width, height), layout="constrained")
    return figure


def zero_line(panel: Any) -> None:
    """Draw a thin line at zero, behind all curves."""
    panel.axhline(0, color="#9AA3AF", linewidth=0.6, zorder=0)


def time_axis(panel: Any, result: AnalysisResult) -> None:
    """Label a panel's time, from the first sample to the last."""
    panel.set_xlabel("time (s)")
    panel.set_xlim(result.time[0], result.time[-1])


def write_title(figure: Any, result: AnalysisResult, *what: str) -> None:
    """Write above a figure what it shows, of which robot and log."""
    told = " · ".join([*what, drawn(result.robot.name, 40), drawn(result.source, 50)])
    figure.suptitle(told, x=0.01, ha="left", fontsize=11)


def write_note(figure: Any, *notes: str) -> None:
    """Write notes below a figure, each from a line of its own on."""
    width = int(LETTERS * figure.get_figwidth())
    told = "\n".join(textwrap.fill(note, width) for note in notes)
    figure.supxlabel(told, x=0.01, ha="left", fontsize=7, color="#5A6270")


def foot(result: AnalysisResult) -> str:
    """Return a note on how the motion was derived, and on how curves are drawn if they are thinned."""
    size = piece_size(result.total, PIECES)
    if size == 1:
        return result.provenance
    how = f"curves are drawn by the least and greatest of every {size:,} samples, numbers are of all"
    return f"{result.provenance} · {how}"


def largest_few(sizes: Sequence[float] | Array, most: int) -> tuple[list[int], list[int]]:
    """Return the indices of the `most` largest and of the others, each ascending; never only one other."""
    order = largest_first(np.asarray(sizes, dtype=float))
    named = len(order) if len(order) == most + 1 else most
    return sorted(order[:named]), sorted(order[named:])
