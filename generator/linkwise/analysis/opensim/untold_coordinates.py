"""Coordinates that no marker tells while it is not seen: inverse kinematics holds them where they were."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linkwise.arrays import Array
from linkwise.escape import listed

POSES = 20
"""Number of poses that are looked at where the same markers are seen: what these tell hangs on the pose."""
STEP = 1e-3
"""Change of a coordinate, in rad or m, by which markers are seen to move."""
LEAST = 1e-4
"""Part of the largest motion of markers below which a motion is none."""
PART = 0.1
"""Share of a coordinate in a motion that no marker shows, from which on it is told."""
ROTATIONAL = 1
"""OpenSim's number for the kind of a coordinate that is an angle."""


def untold_coordinates(
    osim: Any, model: Any, tasks: Any, motion: Path, time: Array, names: Sequence[str], shown: Array
) -> Iterator[str]:
    """Yield lines on coordinates that markers do not determine at some times.

    motion: the file that inverse kinematics wrote, with all times; names: of markers that have a task;
    shown: their places (S, M, 3), NaN if not seen

    A motion of the coordinates that moves no marker is in the null space of the markers' Jacobian, whose rows
    are those of the markers that are seen, and of the coordinates that have a task of their own.
    """
    state = model.initSystem()
    free = [one for one in _all(model.getCoordinateSet()) if not one.isConstrained(state)]
    asked = tasked(osim.IKCoordinateTask, tasks)
    own = np.array([one.getName() in asked for one in free], dtype=float)
    _, patterns = np.unique(np.isfinite(shown).all(axis=2), axis=0, return_inverse=True)
    held = np.zeros((len(time), len(free)), dtype=bool)
    table = osim.TimeSeriesTable(str(motion))
    for pattern in np.unique(patterns):
        (frames,) = np.nonzero(patterns.ravel() == pattern)
        looked = frames[:: -(-len(frames) // POSES)]
        for first, last in zip(looked, [*looked[1:], len(time)], strict=True):
            _pose(model, state, table, first)
            seen = np.isfinite(shown[first]).all(axis=1)
            slopes = _jacobian(
                model, state, free, [name for name, one in zip(names, seen, strict=True) if one]
            )
            held[frames[(frames >= first) & (frames < last)]] = _untold(slopes.reshape(-1, len(free)), own)
    for mask in np.unique(held.T[held.any(axis=0)], axis=0):
        some = listed([one.getName() for at, one in enumerate(free) if (held[:, at] == mask).all()])
        if mask.all():
            yield f"no marker tells {some}: what they are is OpenSim's, and not measured"
        else:
            times = time[mask]
            yield (
                f"no marker that is seen tells {some} in {len(times)} frames between {times[0]:.6g} and"
                f" {times[-1]:.6g} s: OpenSim holds them there, and torques leap; fill the gap, or leave"
                " it out with --from and --to"
            )


def tasked(kind: Any, tasks: Any) -> set[str]:
    """Return the names of what has a task of a kind, such as OpenSim's IKMarkerTask, with a weight."""
    given = [one for one in _all(tasks) if one.getApply() and one.getWeight() > 0.0]
    return {one.getName() for one in given if kind.safeDownCast(one) is not None}


def _all(several: Any) -> list[Any]:
    return [several.get(at) for at in range(several.getSize())]


def _pose(model: Any, state: Any, table: Any, row: int) -> None:
    """Bring the model to a row of the table of a motion."""
    is_degrees = table.getTableMetaDataString("inDegrees") == "yes"
    numbers = table.getRowAtIndex(min(int(row), table.getNumRows() - 1)).to_numpy()
    values = dict(zip(table.getColumnLabels(), numbers, strict=True))
    for one in _all(model.getCoordinateSet()):
        value = float(values.get(one.getName(), one.getValue(state)))
        is_angle = is_degrees and one.getMotionType() == ROTATIONAL and one.getName() in values
        one.setValue(state, np.deg2rad(value) if is_angle else value, False)


def _jacobian(model: Any, state: Any, free: Sequence[Any], names: Sequence[str]) -> Array:
    """Return how places of markers change with coordinates: (M, 3, n), by central differences."""
    markers = [model.getMarkerSet().get(name) for name in names]
    rest = [one.getValue(state) for one in free]

    def places(moved: Any, value: float) -> Array:
        for one, own in zip(free, rest, strict=True):
            one.setValue(state, own, False)
        moved.setValue(state, value, True)  # with all that follows it
        model.realizePosition(state)
        return np.array([one.getLocationInGround(state).to_numpy() for one in markers])

    columns = [
        (places(one, own + STEP) - places(one, own - STEP)) / (2 * STEP)
        for one, own in zip(free, rest, strict=True)
    ]
    return np.stack(columns, axis=-1)


def _untold(slopes: Array, own: Array) -> NDArray[np.bool_]:
    """Return which coordinates have a part in a motion that none of the rows (R, n) shows."""
    rows = np.vstack([slopes, np.diag(own), np.zeros((len(own), len(own)))])  # at least n rows
    _, sizes, motions = np.linalg.svd(rows, full_matrices=False)
    hidden = motions[sizes <= LEAST * sizes.max(initial=0.0)]
    found: NDArray[np.bool_] = np.linalg.norm(hidden, axis=0) > PART
    return found
