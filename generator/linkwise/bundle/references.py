"""Files that files of an analysis name, and that are read too."""

import os
from collections.abc import Sequence
from pathlib import Path

from linkwise.analysis.loads.external import data_files
from linkwise.errors import LinkwiseError


def beside_of(path: Path) -> list[Path]:
    """Return the files that a file of an option names and that are read too: data of OpenSim's loads."""
    if path.suffix.lower() != ".xml":
        return []
    try:
        return [file for file in data_files(path) if file.is_file()]
    except LinkwiseError:  # not a file of loads
        return []


def is_within(files: Sequence[Path], folder: Path) -> bool:
    """Return whether all files lie somewhere in a folder, also by links."""
    return all(Path(os.path.realpath(file)).is_relative_to(os.path.realpath(folder)) for file in files)
