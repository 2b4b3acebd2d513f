"""From markers to a log of joint coordinates, and from plates to loads."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from linkwise.analysis.filtering import lowpass
from linkwise.analysis.loads import Load, Loads
from linkwise.analysis.markers import SUFFIXES, MarkerChoices
from linkwise.analysis.markers.c3d import RecordedC3D, read_c3d
from linkwise.analysis.markers.force_plates import ForcePlates
from linkwise.analysis.opensim.inverse_kinematics import MOTION, FollowedMarkers, inverse_kinematics
from linkwise.analysis.opensim.trc_file import read_trc
from linkwise.analysis.settings import Lowpass
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.input_file import require_file
from linkwise.own_opensim import asked_of_opensim
from linkwise.progress import Progress

FAR = 0.04
"""Root mean square in m from which on distances of markers are told; 2 to 4 cm are the most that is usual."""


@dataclass(frozen=True, eq=False)
class MarkerLog:
    """A log that inverse kinematics made of markers, the loads of plates, and how well markers are met."""

    log: Path
    loads: Loads
    followed: FollowedMarkers
    source: str
    asked: MarkerChoices
    told: tuple[str, ...]

    @property
    def line(self) -> str:
        """Errors of the markers in a line."""
        worst, when, largest = self._largest
        total = float(np.nansum(self.followed.apart**2, axis=1).mean())
        own, rms = self.followed, 1000 * self.rms(self.followed.apart)
        met = f"{len(own.names)} markers are met within {rms:.3g} mm (root mean square)"
        most = f"{1000 * largest:.3g} mm at most, {worst} at {when:.6g} s"
        return f"{met}, {most}; total squared error {total:.3g} m² a frame"

    def record(self) -> dict[str, Any]:
        """Return the errors as plain data, in m."""
        own, (worst, when, largest) = self.followed, self._largest
        each = zip(own.names, own.apart.T, strict=True)
        return {
            "file": self.source,
            "root_mean_square": self.rms(own.apart),
            "total_squared": float(np.nansum(own.apart**2, axis=1).mean()),
            "largest": {"marker": worst, "time": when, "error": largest},
            "each": [
                {"marker": name, "root_mean_square": self.rms(apart), "largest": float(np.nanmax(apart))}
                for name, apart in each
            ],
            "plates": [one._asdict() | {"bare_below": self.asked.least} for one in self.asked.under],
            "lacking": list(own.lacking),
            "unknown": list(own.unknown),
        }

    @property
    def _largest(self) -> tuple[str, float, float]:
        apart = np.nan_to_num(self.followed.apart)
        s, m = np.unravel_index(int(apart.argmax()), apart.shape)
        return self.followed.names[m], float(self.followed.time[s]), float(apart[s, m])

    @staticmethod
    def rms(apart: Array) -> float:
        """Return the root mean square of distances, where markers were seen."""
        return float(np.sqrt(np.nanmean(apart**2)))


def followed(
    log: Path, asked: MarkerChoices | None, loads: Loads, folder: Path, progress: Progress
) -> MarkerLog | None:
    """Return the log that OpenSim makes of a recording of markers; None where the log is none.

    folder: where files may be written; progress: told of frames

    Raises LinkwiseError for choices that go with other logs, a robot that is no model, and what OpenSim,
    ezc3d or the files lack.
    """
    if log.suffix.lower() not in SUFFIXES:
        if asked is not None and (asked.tasks or asked.is_of_plates):
            raise LinkwiseError(
                f"--ik-tasks, --plate, --plate-threshold and --c3d-axes go with a log of markers;"
                f" {log} is none"
            )
        return None
    if asked is None or asked.model.suffix.lower() != ".osim":
        raise LinkwiseError(f"{log}: markers are those of a model of OpenSim; give its .osim file as --robot")
    require_file(log)
    told = []
    if log.suffix.lower() == ".c3d":
        recorded = read_c3d(log, asked.axes)
        markers = recorded.markers
        told.append(f"{recorded.axes} of the laboratory are x of the model, and up")
        with within(str(log)):
            given, notes = _plates(log, asked, recorded)
        loads, told = replace(loads, given=(*loads.given, *given)), [*told, *notes]
    elif not asked.is_of_plates:
        markers = read_trc(log)
    else:
        raise LinkwiseError(
            f"--plate, --plate-threshold and --c3d-axes go with a .c3d file; {log} has neither plates"
            " nor axes"
        )
    progress("inverse kinematics", 0, 1)
    found = asked_of_opensim(
        lambda osim: inverse_kinematics(osim, asked.model, markers, asked.tasks, folder), f"{log}: OpenSim"
    )
    progress("inverse kinematics", 1, 1)
    for names, what in ((found.lacking, "not in the recording"), (found.unknown, "not in the model")):
        told += [f"markers {what}: {listed(names)}"] if names else []
    told += [*markers.told, *found.told]
    motion = folder / MOTION
    made = MarkerLog(motion, loads, found, log.name, asked, tuple(told))
    if (apart := made.rms(found.apart)) > FAR:
        far = f"markers are {1000 * apart:.3g} mm (root mean square) from those of the model"
        told.append(f"{far}; look at the unit, the names and the model's scale")
    return replace(made, told=tuple(told))


def _plates(log: Path, asked: MarkerChoices, recorded: RecordedC3D) -> tuple[tuple[Load, ...], list[str]]:
    """Return the loads of the plates that are given, and what is told of them and the others."""
    under = {one.number: one for one in asked.under}
    missing = [number for number in under if number > recorded.plates.count]
    if missing:
        raise LinkwiseError(f"--plate {missing[0]}: it has {recorded.plates.count} plates, counted from 1")
    found, told = [], []
    for number in range(1, recorded.plates.count + 1):
        if (given := under.get(number)) is None:
            told += _left_out(recorded.plates, number, asked.least)
            continue
        plate = recorded.plates.wrench(number)
        told += plate.told
        is_bare = np.linalg.norm(plate.force, axis=1) < asked.least
        wrench = np.column_stack([plate.force, plate.moment])
        wrench[is_bare] = 0.0  # where a file may have no centre of pressure
        # The ground presses and does not pull: a force that points down is that on the plate.
        if float(np.nansum(wrench[:, 1])) < 0.0:
            told.append(f"plate {number}: its forces point down, as on the plate, and are turned round")
            wrench = -wrench
        if is_bare.all():
            told.append(f"plate {number} never bears {asked.least:g} N: it loads {given.body} with nothing")
        if gaps := np.flatnonzero(np.isnan(wrench).any(axis=1)).tolist():
            raise LinkwiseError(
                f"plate {number}: {len(gaps)} of its {len(wrench)} samples have no numbers, first the"
                f" {gaps[0] + 1}th; fill the gap"
            )
        load = Load(
            given.name,
            given.body,
            wrench[:, :3],
            wrench[:, 3:],
            plate.place,
            recorded.plate_time,
            point_in="world",
            source=log.name,
        )
        found.append(load if asked.cutoff is None else _filtered(load, wrench, asked.cutoff))
    return tuple(found), told


def _filtered(load: Load, wrench: Array, cutoff: float) -> Load:
    """Return a plate's load with its wrench (S, 6) after a low-pass of a cutoff in Hz."""
    time, smooth = np.asarray(load.time), wrench.copy()
    lowpass(smooth, 1.0 / float(time[1] - time[0]), Lowpass(cutoff), flag="--loads-cutoff")
    return replace(load, force=smooth[:, :3], moment=smooth[:, 3:], filtered=cutoff, unfiltered=load)


def _left_out(plates: ForcePlates, number: int, least: float) -> list[str]:
    """Return a line on a plate under no body, where it bears more than `least`, or is not read."""
    try:
        most = float(np.nan_to_num(plates.size(number)).max(initial=0.0))
    except LinkwiseError as error:
        return [f"left out, as it is under no body: {error}"]
    if most > least:
        return [f"plate {number} bears up to {most:.4g} N and is left out; --plate {number}=BODY"]
    return []
