"""A result as OpenSim's storage files: inverse dynamics, their shares, and induced accelerations."""

from collections.abc import Callable
from pathlib import Path

from linkwise.analysis.opensim.induced_storage import induced_files
from linkwise.analysis.opensim.torque_storage import torque_files
from linkwise.analysis.result_rows import ResultRows
from linkwise.analysis.settings import Units
from linkwise.arrays import Array
from linkwise.escape import file_name, file_names


def begin_storages(
    folder: Path, rows: ResultRows, samples: int, name: str, units: Units
) -> Callable[[Array], None]:
    """Begin NAME_InverseDynamics.sto and the other storage files of a result in a folder.

    Return the function that writes a block (rows, some samples) of the result to all of them; without a name
    it does nothing.

    samples: number of all samples; units: of angles; lengths are in m
    """
    if not name:
        return lambda block: None
    files = [*torque_files(rows), *induced_files(rows)]
    names = file_names(f"{file_name(name)}_{file_name(file.name)}" for file in files)
    paths = [folder / f"{own}.sto" for own in names]
    for path, file in zip(paths, files, strict=True):
        file.begin(path, samples, units)

    def write(block: Array) -> None:
        for path, file in zip(paths, files, strict=True):
            file.append(path, block, units)

    return write
