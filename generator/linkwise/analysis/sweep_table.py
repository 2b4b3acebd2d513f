"""Table of a sweep of cutoffs, as Parquet or CSV: a row for each column of the result and each cutoff."""

import csv
from pathlib import Path

import numpy as np

from linkwise.analysis.cutoff_sweep import CutoffSweep
from linkwise.extras import extra

NAME = "cutoff-sweep"
"""Name of its file, without the suffix."""
HEAD = ("column", "unit", "change", "peak_changes_sign", "cutoff", "rms", "peak", "peak_time")


def write_sweep(path: Path, sweep: CutoffSweep, note: str) -> None:
    """Write all rows to `path`, .parquet or .csv, those first that change most; nothing to .none.

    note: JSON that is kept in a Parquet file's schema
    """
    if path.suffix == ".none":
        return
    order, count = sweep.order, len(sweep.cutoffs)
    rows = np.repeat(order, count)
    names, units = ([getattr(sweep.columns[row], what) for row in rows.tolist()] for what in ("name", "unit"))
    numbers = [sweep.change[rows], sweep.changes_sign[rows], np.tile(sweep.cutoffs, len(order))]
    numbers += [sizes[order].ravel() for sizes in (sweep.rms, sweep.peak, sweep.peak_time)]
    if path.suffix == ".csv":
        with path.open("w", encoding="utf-8", newline="") as file:
            table = csv.writer(file)
            table.writerow(HEAD)
            table.writerows(zip(names, units, *(one.tolist() for one in numbers), strict=True))
        return
    arrow = extra("pyarrow")
    texts = [arrow.array(one).dictionary_encode() for one in (names, units)]
    table = arrow.table([*texts, *map(arrow.array, numbers)], names=list(HEAD))
    extra("pyarrow.parquet").write_table(table.replace_schema_metadata({"linkwise": note}), path)
