"""A storage file of OpenSim's, and how it is written."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from linkwise.analysis.settings import Units
from linkwise.arrays import Array
from linkwise.extras import extra


@dataclass(frozen=True)
class StorageFile:
    """A storage file: the end of its name, its title and columns, and the rows of the result each sums."""

    name: str
    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[int, ...], ...]
    turns: tuple[bool, ...]
    """True for columns that are angles."""
    text: str = ""
    """Text above the end of the header."""
    has_angles: bool = True
    """False for a file of forces, whose header never says that angles are in degrees."""

    def begin(self, path: Path, samples: int, units: Units) -> None:
        """Write the header; units: of angles."""
        in_degrees = units == "deg" and self.has_angles
        facts = (
            f"version=1\nnRows={samples}\nnColumns={1 + len(self.columns)}"
            f"\ninDegrees={'yes' if in_degrees else 'no'}"
        )
        names = "\t".join(("time", *("_".join(column.split()) for column in self.columns)))
        title = "_".join(self.name.split()) if self.title == self.name else self.title
        path.write_text(f"{title}\n{facts}\n{self.text}endheader\n{names}\n", encoding="utf-8")

    def append(self, path: Path, values: Array, units: Units) -> None:
        """Append the samples of a part of the result (rows, S), in numbers that read back exactly."""
        columns = [values[0], *(_sum(values, rows) for rows in self.rows)]
        for column, turns in zip(columns[1:], self.turns, strict=True):
            if turns and units == "deg":
                np.degrees(column, out=column)
        arrow, csv = extra("pyarrow"), extra("pyarrow.csv")
        table = arrow.table(columns, names=[str(number) for number in range(len(columns))])
        how = csv.WriteOptions(include_header=False, delimiter="\t", quoting_style="none")
        with path.open("ab") as out:
            csv.write_csv(table, out, how)


def _sum(values: Array, rows: Sequence[int]) -> Array:
    """Return the sum (S,) of rows; neighbours are added without a copy of them."""
    cuts = [at for at in range(1, len(rows)) if rows[at] != rows[at - 1] + 1]
    runs = zip([0, *cuts], [*cuts, len(rows)], strict=True)
    found: Array = sum(values[rows[a] : rows[b - 1] + 1].sum(axis=0) for a, b in runs)
    return found
