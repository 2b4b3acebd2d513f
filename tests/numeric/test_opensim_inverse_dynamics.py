"""Generalized forces over whole trials, ends and all, against OpenSim's own InverseDynamicsTool."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.command_line import run_linkwise
from helpers.induced_setup import COORDINATES, LOADS, MODEL, write_storage

pytest.importorskip(
    "opensim", reason="needs opensim, which has wheels for Linux on x86-64: pip install opensim"
)

import opensim as osim

LIMIT = 1e-3
"""Largest root mean square of an error, as a part of the force's range."""
TRIALS = {
    "60 Hz": (60.0, 151, 6.0),
    "60 Hz in 8 digits": (60.0, 151, 6.0),
    "100 Hz": (100.0, 201, 6.0),
    "200 Hz": (200.0, 301, 15.0),
    "200 Hz, not filtered": (200.0, 301, -1.0),
}
"""Rate and number of samples, and cutoff, below 0 for none.

Times of fewer digits OpenSim takes for uneven ones, and a log shorter than its filter remembers it does not
continue far enough: there it is further off from an even, endless log.
"""


def write_trial(folder: Path, rate: float, samples: int, digits: int) -> None:
    """Write a model, a motion with much at its ends and noise, at that rate, and a plate."""
    (folder / "leg.osim").write_text(MODEL)
    draw, n = np.random.default_rng(samples), len(COORDINATES)
    time = np.round(np.arange(samples) / rate, digits)
    phase, speed = draw.uniform(0.0, 6.0, n), draw.uniform(2.0, 9.0, n)
    q = 0.2 * np.sin(speed * time[:, None] + phase) + draw.normal(scale=1e-4, size=(samples, n))
    write_storage(folder / "walk.sto", np.column_stack([time, q]), COORDINATES)
    plate = np.arange(int(1000 * time[-1]) + 20) / 1000
    wave = np.sin(np.pi * plate / plate[-1])[:, None]
    force, place = wave * [40.0, 600.0, -25.0], np.column_stack([0.1 * plate, 0.0 * plate, 0.0 * plate])
    names = [f"{part}{axis}" for part in "fp" for axis in "xyz"]
    write_storage(folder / "plate.sto", np.column_stack([plate, force, place]), names)
    (folder / "plate.xml").write_text(LOADS)


def by_opensim(folder: Path, cutoff: float, start: float, end: float) -> Any:
    """Return the tool's answer, by name of column, with its time."""
    osim.Logger.setLevelString("Error")
    osim.Logger.removeFileSink()
    tool, excluded = osim.InverseDynamicsTool(), osim.ArrayStr()
    excluded.append("Muscles")
    tool.setExcludedForces(excluded)
    tool.setModelFileName(str(folder / "leg.osim"))
    tool.setCoordinatesFileName(str(folder / "walk.sto"))
    tool.setExternalLoadsFileName(str(folder / "plate.xml"))
    tool.setLowpassCutoffFrequency(cutoff)
    tool.setStartTime(start)
    tool.setEndTime(end)
    tool.setResultsDir(str(folder))
    tool.setOutputGenForceFileName("by_tool.sto")
    assert tool.run()
    return osim.TimeSeriesTable(str(folder / "by_tool.sto"))


def columns(table: Any) -> dict[str, Any]:
    """Return the columns of a table of OpenSim's, and its time."""
    names = table.getColumnLabels()
    return {
        "time": np.array(table.getIndependentColumn()),
        **{name: table.getDependentColumn(name).to_numpy() for name in names},
    }


@pytest.mark.parametrize(("name", "trial"), TRIALS.items(), ids=TRIALS)
def test_whole_trials_are_the_tools(name: str, trial: tuple[float, int, float], tmp_path: Path) -> None:
    rate, samples, cutoff = trial
    write_trial(tmp_path, rate, samples, 8 if "digits" in name else 17)
    last = (samples - 1) / rate
    expected = columns(by_opensim(tmp_path, cutoff, 0.0, last))
    lowpass = () if cutoff < 0 else ("--cutoff", f"{cutoff:g}", "--filter-order", "3")
    asked = "analyze walk.sto --robot leg.osim --loads plate.xml --derivative spline --sto leg --no-page"
    done = run_linkwise(*asked.split(), "--out", "out", *lowpass, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    found = columns(osim.TimeSeriesTable(str(tmp_path / "out/leg_InverseDynamics.sto")))
    assert sorted(found) == sorted(expected)
    titles = (path.read_text().splitlines()[0] for path in tmp_path.rglob("*tool.sto"))
    assert (tmp_path / "out/leg_InverseDynamics.sto").read_text().splitlines()[0] in titles
    for column in set(expected) - {"time"}:
        here = np.interp(expected["time"], found["time"], found[column])
        off = np.sqrt(np.mean((here - expected[column]) ** 2)) / np.ptp(expected[column])
        assert off <= LIMIT, f"{column}: {100 * off:.3g} % of its range"
    for column in set(expected) - {"time"}:
        shares = columns(osim.TimeSeriesTable(str(tmp_path / f"out/leg_{column}.sto")))
        whole = sum(values for share, values in shares.items() if share not in ("time", "total"))
        assert np.abs(whole - shares["total"]).max() <= 1e-9 * np.abs(shares["total"]).max()
        np.testing.assert_array_equal(shares["total"], found[column])
