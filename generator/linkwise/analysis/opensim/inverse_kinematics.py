"""OpenSim's own inverse kinematics: coordinates that bring a model's markers closest to recorded ones."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from linkwise.analysis.opensim.recorded_markers import RecordedMarkers
from linkwise.analysis.opensim.trc_file import write_trc
from linkwise.analysis.opensim.untold_coordinates import tasked, untold_coordinates
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.escape import listed

MARKERS, MOTION, LOCATIONS = "markers.trc", "inverse_kinematics.mot", "_ik_model_marker_locations.sto"
FROM_FILE = 2
"""Kind of a coordinate's task whose values are in a file."""
ACCURACY = 1e-8
"""OpenSim's usual 1e-5 ends its search up to 0.3 mrad from where markers are met exactly."""
DIGITS = 17
"""Digits after the point: OpenSim's usual eight move accelerations by up to 2e-4 m/s² at 100 Hz."""


@dataclass(frozen=True, eq=False)
class FollowedMarkers:
    """The motion as a storage file, and how far markers are from where they were recorded."""

    motion: bytes
    time: Array
    names: tuple[str, ...]
    """Markers that model, recording and tasks have."""
    apart: Array
    """Distances (S, M) in m; NaN where a marker was not seen."""
    lacking: tuple[str, ...]
    """Markers of the model that the recording lacks, or never sees."""
    unknown: tuple[str, ...]
    """Markers of the recording that the model lacks."""
    told: tuple[str, ...]
    """Lines on coordinates that markers do not tell at some times."""


def inverse_kinematics(
    osim: Any, model: Path, recorded: RecordedMarkers, tasks: Path | None, folder: Path
) -> FollowedMarkers:
    """Return what the tool finds; osim: the module of OpenSim; folder: where it may write.

    Raises LinkwiseError where model and recording share fewer than three markers, where no task is of one
    of these, and where none that has a task is seen.
    """
    opened = osim.Model(str(model))
    opened.initSystem()
    own = [opened.getMarkerSet().get(at).getName() for at in range(opened.getMarkerSet().getSize())]
    time = recorded.time
    names = [name for name in own if name in recorded.seen]
    if len(names) < 3:
        raise LinkwiseError(
            f"{len(names)} of its markers are in {model}, which has {listed(own[:8])}; the recording has"
            f" {listed(recorded.seen[:8])}; name them alike"
        )
    followed = _tasks(osim, tasks, names)
    asked = [name for name in names if name in tasked(osim.IKMarkerTask, followed)]
    if not asked:
        raise LinkwiseError(
            f"{tasks}: none of its tasks is of a marker that model and recording share, and weighs more"
            f" than nothing; they share {listed(names[:8])}"
        )
    shown = recorded.of(asked)
    _require_some(time, shown)
    write_trc(folder / MARKERS, recorded)
    tool = osim.InverseKinematicsTool()
    tool.setModel(opened)
    tool.set_IKTaskSet(followed)
    tool.setMarkerDataFileName(str(folder / MARKERS))
    tool.setStartTime(float(time[0]))
    tool.setEndTime(float(time[-1]))
    _run(osim, tool, folder)
    files = sorted(folder.glob(f"*{LOCATIONS}"))
    if not files or not (folder / MOTION).is_file():
        raise LinkwiseError("its inverse kinematics ends without a motion")
    found = osim.TimeSeriesTable(str(files[0]))
    labels, rows = list(found.getColumnLabels()), found.getMatrix().to_numpy().copy()
    used = [name for name in names if f"{name}_tx" in labels]
    at = [[labels.index(f"{name}_t{axis}") for axis in "xyz"] for name in used]
    when = np.asarray(found.getIndependentColumn(), dtype=float)
    row = np.searchsorted((time[1:] + time[:-1]) / 2, when)  # the file's times are rounded
    given = recorded.of(used)[row]
    untold = untold_coordinates(osim, osim.Model(str(model)), followed, folder / MOTION, time, asked, shown)
    return FollowedMarkers(
        (folder / MOTION).read_bytes(),
        when,
        tuple(used),
        np.linalg.norm(rows[:, np.array(at)] - given, axis=2),
        tuple(name for name in own if name not in recorded.seen),
        tuple(name for name in recorded.names if name not in own),
        tuple(untold),
    )


def _require_some(time: Array, shown: Array) -> None:
    """Raise LinkwiseError where no marker is seen, at which OpenSim's search ends."""
    blind = time[~np.isfinite(shown).any(axis=(1, 2))]
    if len(blind):
        raise LinkwiseError(
            f"none of the model's markers that have a task is seen in {len(blind)} frames between"
            f" {blind[0]:.6g} and {blind[-1]:.6g} s; fill the gap, or cut the recording there"
        )


def _run(osim: Any, tool: Any, folder: Path) -> None:
    """Have a tool write the motion, and where the model's markers are in it, into a folder."""
    osim.IO.SetPrecision(DIGITS)  # which whoever used OpenSim before, in this process, may have set too
    tool.set_accuracy(ACCURACY)
    tool.setOutputMotionFileName(str(folder / MOTION))
    tool.setResultsDir(str(folder))
    tool.set_report_marker_locations(True)
    tool.set_report_errors(False)
    tool.run()


def _tasks(osim: Any, tasks: Path | None, names: list[str]) -> Any:
    """Return the tasks of a file; of one without any, and of none, every marker with the weight 1."""
    if tasks is not None:
        kind = osim.OpenSimObject.makeObjectFromFile(str(tasks)).getConcreteClassName()
        if kind not in ("InverseKinematicsTool", "IKTaskSet"):
            raise LinkwiseError(
                f"{tasks}: it is a {kind}; give a setup of inverse kinematics, or its IKTaskSet"
            )
        given = osim.IKTaskSet(str(tasks)) if kind == "IKTaskSet" else osim.InverseKinematicsTool(str(tasks))
        found = given if kind == "IKTaskSet" else given.getIKTaskSet()
        every = [osim.IKCoordinateTask.safeDownCast(found.get(at)) for at in range(found.getSize())]
        if any(one is not None and one.getApply() and one.getValueType() == FROM_FILE for one in every):
            raise LinkwiseError(
                f"{tasks}: a coordinate follows a file, which is not read; leave that task out"
            )
        if found.getSize():
            return found.clone()
    made = osim.IKTaskSet()
    for name in names:
        task = osim.IKMarkerTask()
        task.setName(name)
        task.setWeight(1.0)
        task.setApply(True)
        made.cloneAndAppend(task)
    return made
