"""Motion logs as blocks of numbers: delimited text, OpenSim storage and Parquet behind one face."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Protocol

from linkwise.analysis.logs.headers import open_delimited, open_storage
from linkwise.analysis.logs.parquet import ParquetLog
from linkwise.errors import LinkwiseError, within
from linkwise.input_file import require_file
from linkwise.package.load import Array


class Log(Protocol):
    """A table of numbers on disk, read once from top to bottom."""

    @property
    def columns(self) -> tuple[str, ...]:
        """Column names, in the file's order."""

    @property
    def degrees(self) -> bool | None:
        """Whether angles are in degrees, where the file says so."""

    @property
    def warnings(self) -> tuple[str, ...]:
        """What looks wrong in the file and need not be."""

    @property
    def size(self) -> int:
        """What `read` counts up to: bytes of text, or rows."""

    @property
    def first_row(self) -> int:
        """Number of the first sample as an editor or a spreadsheet counts rows, from 1."""

    def read(self, columns: Sequence[int], rows: int = ...) -> Iterator[tuple[Array, int]]:
        """Yield blocks (at most `rows`, len(columns)), NaN possible, and how much of `size` is done.

        columns: positions in `columns`, in the order wanted. Raises LinkwiseError, naming file, row and
        column, for what is not a number.
        """


def open_log(path: Path) -> Log:
    """Open a log by its suffix: .csv, .txt or .tsv, .mot or .sto, .parquet.

    Raises LinkwiseError for a missing file, an unknown suffix, or a header that cannot be read.
    """
    suffix = path.suffix.lower()
    with within(str(path)):
        require_file(path)
    try:
        if suffix in {".csv", ".tsv", ".txt"}:
            return open_delimited(path)
        if suffix in {".mot", ".sto"}:
            return open_storage(path)
        if suffix == ".parquet":
            return ParquetLog.open(path)
    except UnicodeDecodeError as error:
        raise LinkwiseError(f"{path}: not UTF-8 text; save it as UTF-8") from error
    except OSError as error:
        raise LinkwiseError(f"{path}: cannot be read: {error.strerror}") from error
    raise LinkwiseError(f"{path}: unknown suffix; give a .csv, .mot, .sto or .parquet file")
