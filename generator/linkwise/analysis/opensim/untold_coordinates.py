"""Coordinates that no marker tells while it is not seen: inverse kinematics holds them where they were."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linkwise.arrays import Array
from linkwise.escape import listed

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

    motion: the file that inverse kinematics wrote, with all times; shown: places (S, M, 3), NaN if not seen

    A motion of the coordinates that moves no marker is in the null space of the markers' Jacobian, whose rows
    are those of the markers that are seen, and of the coordinates that have a task of their own.
    """
    state = model.initSystem()
    seen = np.asarray(np.isfinite(shown).all(axis=2))
    free = [one for one in _all(model.getCoordinateSet()) if not one.isConstrained(state)]
    asked = [one for one in _all(tasks) if one.getApply() and one.getWeight() > 0.0]
    coordinates = {one.getName() for one in asked if osim.IKCoordinateTask.safeDownCast(one) is not None}
    markers = {one.getName() for one in asked if osim.IKMarkerTask.safeDownCast(one) is not None}
    used = [at for at, name in enumerate(names) if name in markers]
    _pose(osim, model, state, motion, int(seen[:, used].sum(axis=1).argmax()))
    slopes = _jacobian(model, state, free, [names[at] for at in used])
    own = np.array([one.getName() in coordinates for one in free], dtype=float)
    patterns, which = np.unique(seen[:, used], axis=0, return_inverse=True)
    untold = np.array([_untold(slopes[pattern].reshape(-1, len(free)), own) for pattern in patterns])
    held = untold[which.ravel()]
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


def _all(several: Any) -> list[Any]:
    return [several.get(at) for at in range(several.getSize())]


def _pose(osim: Any, model: Any, state: Any, motion: Path, row: int) -> None:
    """Bring the model to a row of a motion."""
    table = osim.TimeSeriesTable(str(motion))
    is_degrees = table.getTableMetaDataString("inDegrees") == "yes"
    numbers = table.getRowAtIndex(min(row, table.getNumRows() - 1)).to_numpy()
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
