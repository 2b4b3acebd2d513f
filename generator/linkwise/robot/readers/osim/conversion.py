"""Models of versions that are not read here, brought to the latest one by OpenSim itself."""

from pathlib import Path

from linkwise.bounded_file import MIB
from linkwise.errors import within
from linkwise.output import passing_folder
from linkwise.own_opensim import asked_of_opensim
from linkwise.own_process import ProcessLimits

LIMITS = ProcessLimits(seconds=300, memory=2048 * MIB)


def converted(path: Path) -> bytes:
    """Return the text of a model as OpenSim's latest version writes it.

    OpenSim reads it in a process of its own. Raises LinkwiseError where OpenSim is not installed, saying how
    to mend that, and where it does not read the file.
    """
    with (
        within("OpenSim itself brings it to a version that is read; open and save it there, or here"),
        passing_folder() as folder,
    ):
        whole = folder / "model.osim"
        asked_of_opensim(lambda osim: osim.Model(str(path.resolve())).printToXML(str(whole)), limits=LIMITS)
        return whole.read_bytes()
