"""Sizes of torques and powers at several cutoffs of the low-pass: which depend on it, and how much."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from linkwise_runtime.chosen_names import nearest_first

from linkwise.analysis.certain_signs import SMALL, TORQUES
from linkwise.analysis.result_quantities import DEVIATION_OF, PASSIVE, TERMS
from linkwise.analysis.result_rows import Column, ResultRows
from linkwise.arrays import Array, Index, Mask
from linkwise.errors import LinkwiseError
from linkwise.escape import listed

SWEPT = tuple(name for name in DEVIATION_OF.values() if name not in ("q", "qd", "qdd"))
"""Quantities whose sizes are told: all but motion, what was measured, and traces."""
SHARES = (*TERMS, *PASSIVE, "tau_load")
"""Torques by one cause, which are listed."""
SHOWN = 5
"""Shares that a terminal lists, each of another cause."""


class RowSizes:
    """A sink that sums up root mean squares of swept rows, and finds their largest magnitudes."""

    def __init__(self, rows: ResultRows) -> None:
        numbers = np.sort(rows.numbers(*SWEPT))
        quantities = [rows[name] for name in SWEPT if name in rows]
        self._some = [(one.rows, np.searchsorted(numbers, one.numbers)) for one in quantities]
        self.columns = tuple(rows.columns[row] for row in numbers.tolist())
        self._samples, self._squares = 0, np.zeros(len(numbers))
        self._peaks = np.zeros((2, len(numbers)))

    def __call__(self, block: Array) -> None:
        """Look through a block (rows, samples) whose first row is the time."""
        is_first = not self._samples
        self._samples += block.shape[1]
        for some, own in self._some:
            values = block[some]
            self._squares[own] += np.einsum("rs,rs->r", values, values)
            at = np.abs(values).argmax(axis=1)
            found = np.array([values[np.arange(len(values)), at], block[0, at]])
            peaks = self._peaks[:, own]
            larger = (np.abs(found[0]) > np.abs(peaks[0])) | is_first
            self._peaks[:, own] = np.where(larger, found, peaks)

    def sizes(self) -> tuple[Array, Array, Array]:
        """Return of each row the root mean square, the value of largest magnitude, and its time in s."""
        return np.sqrt(self._squares / max(1, self._samples)), self._peaks[0], self._peaks[1]


@dataclass(frozen=True, eq=False)
class CutoffSweep:
    """Sizes of R torques and powers at C cutoffs of the low-pass, over every sample of the movement."""

    columns: tuple[Column, ...]
    """Columns of the result that are swept, (R,)."""
    cutoffs: Array
    """Cutoffs in Hz, ascending, (C,)."""
    own: int
    """Number of the analysis's own cutoff among them."""
    low: int
    """Number of the lowest cutoff that was asked for, from which changes count."""
    high: int
    """Number of the highest cutoff that was asked for."""
    rms: Array
    """Root mean squares, (R, C), in each column's unit."""
    peak: Array
    """Values of largest magnitude, (R, C), with their sign."""
    peak_time: Array
    """Times of these in s, (R, C)."""
    joints: tuple[str, ...]
    links: tuple[str, ...]
    residuals: frozenset[int] = frozenset()
    """Numbers of the joints that nothing drives, listed after the others and never the largest."""

    def __getitem__(self, name: str) -> tuple[Array, Array, Array]:
        """Return root mean squares, values of largest magnitude and their times, (C,) each, of a column.

        Raises LinkwiseError for a name that no column has.
        """
        names = [column.name for column in self.columns]
        if name not in names:
            near = listed(map(repr, nearest_first(name, names)))
            raise LinkwiseError(f"no column {name!r} is swept; nearest are {near}")
        row = names.index(name)
        return self.rms[row], self.peak[row], self.peak_time[row]

    @cached_property
    def change(self) -> Array:
        """Change of root mean squares from the lowest to the highest cutoff, in parts of the analysis's own.

        (rms_high - rms_low) / rms_own, (R,); 0 for what is 0 at the analysis's own cutoff.
        """
        return self._relative(self.rms)

    @cached_property
    def peak_change(self) -> Array:
        """Change of largest magnitudes likewise, (R,)."""
        return self._relative(np.abs(self.peak))

    def _relative(self, sizes: Array) -> Array:
        own, moved = sizes[:, self.own], sizes[:, self.high] - sizes[:, self.low]
        found: Array = np.divide(moved, own, out=np.zeros(len(own)), where=own > 0.0)
        return found

    @cached_property
    def changes_sign(self) -> Mask:
        """True where what is largest has another sign at the highest cutoff than at the lowest, (R,)."""
        found: Mask = self.peak[:, self.low] * self.peak[:, self.high] < 0.0
        return found

    @cached_property
    def order(self) -> Index:
        """Numbers of all rows, those first that change most, (R,)."""
        return np.argsort(-np.abs(self.change), kind="stable")

    @cached_property
    def listed(self) -> Index:
        """Numbers of the rows of shares by one cause, those first that change most, of residuals last.

        Those below a thousandth of their joint's largest torque at every cutoff are left out.
        """
        largest = np.abs(self.peak).max(axis=1)
        most: dict[int | None, float] = {}
        for column, size in zip(self.columns, largest.tolist(), strict=True):
            if column.quantity in (*TORQUES, *SHARES):
                most[column.joint] = max(most.get(column.joint, 0.0), size)
        kept = [
            row
            for row in self.order.tolist()
            if self.columns[row].quantity in SHARES and largest[row] > SMALL * most[self.columns[row].joint]
        ]
        return np.array(sorted(kept, key=self._is_residual), np.intp)

    @property
    def span(self) -> str:
        """Words for the range, "from 4 to 12 Hz"."""
        return f"from {self.cutoffs[self.low]:.4g} to {self.cutoffs[self.high]:.4g} Hz"

    def cause(self, column: Column) -> str:
        """Return words for what a share is due to, "the acceleration of elbow"."""
        what = {"tau_qdd": "acceleration", "tau_qd": "velocity"}.get(column.quantity)
        if what is not None and column.cause is not None:
            return f"the {what} of {self.joints[column.cause]}"
        name = column.name.rpartition("/")[2]
        if column.quantity == "tau_share":
            return name
        return f"load {name}" if column.quantity == "tau_load" else column.quantity.removeprefix("tau_")

    @property
    def sentence(self) -> str:
        """Sentence on how much joint torques and shares depend on the cutoff."""
        torques = [row for row in self.order.tolist() if self.columns[row].quantity == "tau"]
        torques = sorted((row for row in torques if self._is_large(row)), key=self._is_residual)
        if not torques or not len(self.listed):
            return ""
        whole, share = torques[0], int(self.listed[0])
        column = self.columns[share]
        through = "" if column.link is None else f" through {self.links[column.link]}"
        return (
            f"cutoffs {self.span} change the root mean square of joint torques by up to"
            f" {100 * abs(self.change[whole]):.3g} % ({self._joint(whole)}), that of their shares by up to"
            f" {100 * abs(self.change[share]):.3g} % ({self.cause(column)} on {self._joint(share)}{through}),"
            f" of what they are at {self.cutoffs[self.own]:.4g} Hz"
        )

    def _joint(self, row: int) -> str:
        joint = self.columns[row].joint
        assert joint is not None
        return self.joints[joint]

    def _is_residual(self, row: int) -> bool:
        return self.columns[row].joint in self.residuals

    def _is_large(self, row: int) -> bool:
        """Return whether a joint's torque is more than next to nothing beside the largest in its unit."""
        unit = self.columns[row].unit
        every = [at for at, one in enumerate(self.columns) if one.quantity == "tau" and one.unit == unit]
        return bool(np.abs(self.peak[row]).max() > SMALL * np.abs(self.peak[every]).max())

    @property
    def lines(self) -> Iterator[str]:
        """Yield the lines that a terminal shows."""
        if self.sentence:
            yield self.sentence
        ends = [self.low, self.own, self.high]
        for row in self._by_cause()[:SHOWN]:
            column = self.columns[row]
            rms, peak = (
                ", ".join(f"{one:.3g}" for one in sizes[row, ends]) for sizes in (self.rms, self.peak)
            )
            sign = ", which changes its sign" if self.changes_sign[row] else ""
            yield (
                f"  {column.name}: root mean square {rms} {column.unit} at"
                f" {', '.join(f'{c:.4g}' for c in self.cutoffs[ends])} Hz ({100 * self.change[row]:+.3g} %);"
                f" largest {peak} {column.unit}{sign}"
            )

    def _by_cause(self) -> list[int]:
        """Return of each cause the share that changes most, those first that change most."""
        first: dict[str, int] = {}
        for row in self.listed.tolist():
            first.setdefault(self.cause(self.columns[row]), row)
        return list(first.values())

    def record(self) -> dict[str, Any]:
        """Return this as plain data: listed shares, and joint torques, those first that change most."""
        torques = [row for row in self.order.tolist() if self.columns[row].quantity == "tau"]
        return {
            "cutoffs_hz": self.cutoffs.tolist(),
            "analysed_at_hz": float(self.cutoffs[self.own]),
            "changes_from_hz": float(self.cutoffs[self.low]),
            "changes_to_hz": float(self.cutoffs[self.high]),
            "left_out_below_part_of_largest": SMALL,
            "sentence": self.sentence,
            "joint_torques": list(map(self._row, torques)),
            "shares": list(map(self._row, self.listed.tolist())),
        }

    def _row(self, row: int) -> dict[str, Any]:
        return {
            "name": self.columns[row].name,
            "unit": self.columns[row].unit,
            "change": float(self.change[row]),
            "peak_change": float(self.peak_change[row]),
            "peak_changes_sign": bool(self.changes_sign[row]),
            "rms": self.rms[row].tolist(),
            "peak": self.peak[row].tolist(),
            "peak_time": self.peak_time[row].tolist(),
        }
