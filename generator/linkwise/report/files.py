"""Reports on disk: all files of a report, or none."""

import csv
import io
import json
import os
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from linkwise.errors import LinkwiseError


def write_all(directory: Path, files: Mapping[str, bytes]) -> tuple[Path, ...]:
    """Write every file beside its target, then rename; raises LinkwiseError if that fails."""
    waiting: list[tuple[Path, Path]] = []
    try:
        directory.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            target = directory / name
            beside = directory / f".{name}.{os.getpid()}"
            waiting.append((beside, target))
            beside.write_bytes(content)
        for beside, target in waiting:
            beside.replace(target)
    except OSError as error:
        raise _refused(directory, error) from error
    finally:
        for beside, _ in waiting:
            beside.unlink(missing_ok=True)
    return tuple(target for _, target in waiting)


def require_writable(directory: Path) -> None:
    """Raise LinkwiseError, before any work is done, if no file can be made where `directory` is to be."""
    place = directory
    while not place.exists() and place != place.parent:
        place = place.parent
    try:
        with tempfile.TemporaryFile(dir=place):
            pass
    except OSError as error:
        raise _refused(directory, error) from error


def _refused(directory: Path, error: OSError) -> LinkwiseError:
    reason = error.strerror or type(error).__name__
    return LinkwiseError(f"{directory}: cannot write the report ({reason}); choose another --out")


def json_text(data: Any) -> str:
    """JSON as people read it."""
    return json.dumps(data, indent=2, ensure_ascii=False) + "\n"


def csv_text(header: Iterable[str], rows: Iterable[Iterable[object]]) -> str:
    """Comma-separated values; None is an empty cell."""
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(["" if cell is None else cell for cell in row] for row in rows)
    return out.getvalue()
