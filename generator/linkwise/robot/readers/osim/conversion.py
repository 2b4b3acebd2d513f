"""Models of versions that are not read here, brought to the latest one by OpenSim itself."""

import tempfile
from pathlib import Path
from typing import Any

from linkwise.bounded_file import MIB
from linkwise.errors import LinkwiseError, within
from linkwise.extras import extra
from linkwise.own_process import Ended, ProcessLimits, in_own_process

LIMITS = ProcessLimits(seconds=300, memory=2048 * MIB)


def converted(path: Path) -> bytes:
    """Return the text of a model as OpenSim's latest version writes it.

    OpenSim reads it in a process of its own. Raises LinkwiseError where OpenSim is not installed, saying how
    to mend that, and where it does not read the file.
    """
    with within("OpenSim itself brings it to a version that is read; open and save it there, or here"):
        osim = extra("opensim")
    try:
        return in_own_process(lambda: _written(osim, path.resolve()), LIMITS)
    except (Ended, RuntimeError, MemoryError) as error:
        why = " ".join(str(error).split())
        raise LinkwiseError(f"OpenSim does not bring it to one that is read: {why}") from None


def _written(osim: Any, path: Path) -> bytes:
    osim.Logger.removeFileSink()  # it would write opensim.log into the working directory
    osim.Logger.setLevelString("Off")
    with tempfile.TemporaryDirectory() as folder:
        whole = Path(folder) / "model.osim"
        osim.Model(str(path)).printToXML(str(whole))
        return whole.read_bytes()
