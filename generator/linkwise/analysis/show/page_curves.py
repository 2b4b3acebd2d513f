"""Curves that a page draws, their numbers over all samples, and how a page holds numbers and scripts."""

import base64
import gzip
from typing import Any

import numpy as np

from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_quantities import MOTION, PASSIVE, QUANTITIES
from linkwise.analysis.row_sums import RowSums, SumDeviations
from linkwise.analysis.show.bands import Bands
from linkwise.analysis.show.drawn_curves import DrawnCurves, drawn_curves, piece_size
from linkwise.arrays import Array
from linkwise.extras import extra


def plotly_parts() -> dict[str, str]:
    """Return plotly's script, packed, and its notice; it is most of a page: 4.8 MB, and packed 2.0 MB."""
    script = extra("plotly.offline").get_plotlyjs()
    notice = script[: script.find("*/")].replace("*", " ").strip("/ \n")
    return {"notice": " ".join(notice.split()), "plotly": packed(script)}


def packed(text: str) -> str:
    """Return a text as gzip in base64."""
    return base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode("ascii")


def encoded(values: Array, kind: str = "<f8") -> str:
    """Return numbers as base64, float64 to the last bit unless another type is given."""
    return base64.b64encode(np.ascontiguousarray(values, kind).tobytes()).decode("ascii")


PIECES, POINTS = 750, 1_000_000
"""Most pieces of a long curve, and most points of all curves together; a point takes five bytes."""
KINDS = {"tau": ("whole",), "tau_link": ("whole",), **{name: (name, "motion") for name in MOTION}}
KINDS |= {name: (name,) for name in ("tau_gravity", "tau_share", *PASSIVE, "tau_load")}
"""Kinds of the curves in which a quantity counts."""
Key = tuple[str, int, int | None, int | None]
"""Kind of cause ("motion" and "whole" are sums), indices of joint and of cause, share or load, and link, None
for all links."""


class CurveSums:
    """Sums of rows, one for each curve."""

    def __init__(self, result: AnalysisResult) -> None:
        place = {i: at for at, i in enumerate(result.robot.driven)}
        rows: dict[Key, list[int]] = {}
        for name, kinds in KINDS.items():
            axes = QUANTITIES[name].axes
            for row, at in result.rows[name].listed():
                index = dict(zip(axes, at, strict=True))
                link, moved = index.get("link"), place.get(index.get("cause", -1))
                cause = index.get("load", index.get("share", moved))
                for kind in kinds:
                    for some in dict.fromkeys((link if name == "tau_link" else None, link)):
                        rows.setdefault((kind, place[index["joint"]], cause, some), []).append(row)
        self.keys = tuple(rows)
        self.rows = [np.array(some, np.intp) for some in rows.values()]
        self._sums = RowSums(self.rows)

    def __call__(self, part: AnalysisResult) -> Array:
        """Return the curves (curves, S) of a part of the result."""
        return self._sums(part.values)


def page_pieces(curves: int) -> int:
    """Return the number of pieces into which each of so many long curves of a page is cut."""
    return max(2, min(PIECES, POINTS // (2 * curves)))


def curve_data(result: AnalysisResult, sums: CurveSums, pieces: int, is_thinned: bool) -> dict[str, Any]:
    """Return the mean and largest magnitude of each curve, by its key, and if thinned its points.

    The mean and the largest magnitude are over all samples. The points of a curve that is drawn whole are the
    samples on the page. The instant of the largest torque by motion is included, too, and where deviations
    are known those of the means, which curves have no certain sign, and if thinned their bands.
    """
    spread = SumDeviations(result.rows, sums.rows)
    mean, peak = np.zeros((2, len(sums.keys)))
    moving = result.rows.numbers(*MOTION)
    most, busiest = 0.0, float(result.time[0])
    for part in result.parts():
        spread.add(part.values)
        sizes = np.abs(sums(part))
        mean += sizes.sum(axis=1) / result.total
        np.maximum(peak, sizes.max(axis=1), out=peak)
        moved = np.abs(part.values[moving]).max(axis=0, initial=0.0)
        if moved.max() > most:
            most, busiest = float(moved.max()), float(part.time[moved.argmax()])
    return {
        "keys": [" ".join("null" if x is None else str(x) for x in key) for key in sums.keys],
        "mean": mean.tolist(),
        "peak": peak.tolist(),
        "busiest": busiest,
        "piece": piece_size(result.total, pieces) if is_thinned else 1,
        "points": point_data(result, drawn_curves(result, sums, pieces), pieces) if is_thinned else None,
        "deviation": spread.mean().tolist(),
        "unsure": spread.unsure([key[1] for key in sums.keys]).tolist(),
        "bands": band_data(Bands(result, sums.rows, pieces)) if is_thinned else None,
    }


def band_data(bands: Bands) -> dict[str, Any] | None:
    """Return the edges of bands, float32, and which curves have one; None without any.

    The times are those in the middle of each piece.
    """
    if not len(bands):
        return None
    low, high = (encoded(edge, "<f4") for edge in (bands.low, bands.high))
    return {"curves": bands.curves, "time": encoded(bands.time), "low": low, "high": high}


def point_data(result: AnalysisResult, found: DrawnCurves, pieces: int) -> dict[str, str]:
    """Return the points of thinned curves, float32, and each one's place in its piece, in 255ths of that."""
    size = piece_size(result.total, pieces)
    per = found.values.shape[1] // max(1, len(found.middle))
    starts = size * (np.arange(found.values.shape[1]) // per)
    within = (found.time - float(result.time[0])) * result.rate - starts
    offsets = np.rint(np.clip(within / max(1, size - 1), 0.0, 1.0) * 255)
    return {"values": encoded(found.values, "<f4"), "offsets": encoded(offsets, "u1")}


def stride_for(samples: int, columns: int, numbers: int, most: int) -> int:
    """Return the smallest stride that keeps at most `most` samples and `numbers` numbers in all."""
    return max(1, -(-samples // max(2, min(most, numbers // columns))))


def at_instants(result: AnalysisResult, stride: int) -> Array:
    """Return every `stride`-th sample, the first included, (columns, kept)."""
    seen, kept = 0, list[Array]()
    for part in result.parts():
        kept.append(part.values[:, -seen % stride :: stride].copy())
        seen += part.values.shape[1]
    return np.concatenate(kept, axis=1)
