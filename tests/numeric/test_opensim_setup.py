"""Answers to setups of OpenSim's induced acceleration analysis, against OpenSim's own analysis.

OpenSim takes positions, velocities and torques from the result, and tells what each source accelerates. Its
velocity source has in it what the ground does to a foot that turns; here a contact tells that of itself, and
of slip. The ground is therefore asked for what it makes of the velocity forces, given as torques.
"""

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.answers import relative_error
from helpers.command_line import run_linkwise
from helpers.induced_setup import BODIES, CENTRE_OF_PRESSURE, COORDINATES, read_storage, write_case

pytest.importorskip(
    "opensim", reason="needs opensim, which has wheels for Linux on x86-64: pip install opensim"
)

import opensim as osim

from numeric.opensim_induced import Foot, by_source, induced_accelerations
from numeric.opensim_model import LoadedModel, numbers

LIMIT = 1e-9
SOCKETS = "<socket_body_1>/ground</socket_body_1><socket_body_2>/bodyset/body3</socket_body_2>"
CONSTRAINTS = {
    "swings": "",
    "rolls": '<RollingOnSurfaceConstraint name="sole"><rolling_body>body3</rolling_body>'
    "<surface_body>ground</surface_body></RollingOnSurfaceConstraint>",
    "stands": f'<PointConstraint name="sole">{SOCKETS}</PointConstraint>',
    "stuck": '<WeldConstraint name="sole"><socket_frame1>/ground</socket_frame1>'
    '<socket_frame2>here</socket_frame2><frames><PhysicalOffsetFrame name="here"><socket_parent>'
    "/bodyset/body3</socket_parent><translation>0.1 0 0</translation></PhysicalOffsetFrame></frames>"
    "</WeldConstraint>",
}
ENDS = {"": ("",), "body": ("_Ox", "_Oy", "_Oz", "_X", "_Y", "_Z"), "centre": ("_X", "_Y", "_Z")}
FILES = {
    **dict.fromkeys(COORDINATES, ENDS[""]),
    **dict.fromkeys(BODIES, ENDS["body"]),
    "center_of_mass": ENDS["centre"],
}
Answers = dict[str, dict[str, Any]]
"""Accelerations by file and source."""


class Result:
    """The answer to a setup at one sample: motion and torques, and the accelerations by file and source."""

    def __init__(self, folder: Path, sample: int) -> None:
        with (folder / "analysis.csv").open(encoding="utf-8", newline="") as file:
            table = list(csv.DictReader(file))[sample]
        self.time = float(table["time"])
        self.q, self.qd, self.tau = (
            np.array([float(table[f"{kind}/{name}"]) for name in COORDINATES]) for kind in ("q", "qd", "tau")
        )
        self.shares: Answers = {}
        for name, ends in FILES.items():
            columns = read_storage(folder / f"walk_InducedAccelerations_{name}.sto")
            sources = [column.removesuffix(ends[0]) for column in columns if column.endswith(ends[0])]
            self.shares[name] = {
                source: np.array([columns[source + end][sample] for end in ends])
                for source in sources
                if source != "time"
            }


@pytest.fixture(scope="module", params=CONSTRAINTS)
def answered(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """Return the folder of a case and its answer, out/, and how the foot is held."""
    folder, kind = tmp_path_factory.mktemp("setup"), request.param
    loads = "plate.xml" if CONSTRAINTS[kind] else ""
    write_case(folder, CONSTRAINTS[kind], loads, f"{' '.join(BODIES)}")
    done = run_linkwise(
        "analyze",
        "--opensim-setup",
        "setup.xml",
        "--out",
        "out",
        "--format",
        "csv",
        "--no-page",
        folder=folder,
    )
    assert done.returncode == 0, done.stderr
    return folder, kind


def asked(folder: Path, result: Result, foot: Foot | None, torques: Mapping[str, Any], qd: Any) -> Answers:
    """Return OpenSim's answers for actuators of these torques, by their names' beginnings."""
    model = LoadedModel(folder / "leg.osim", COORDINATES)
    for kind, values in torques.items():
        for name, torque in zip(COORDINATES, values, strict=True):
            model.actuate(f"{kind}_{name}", osim.CoordinateActuator(name), torque)
    made = folder / "opensim"
    made.mkdir(exist_ok=True)
    induced_accelerations(model, result.q, qd, foot, made)
    return {name: by_source(made / f"_induced_{name}.sto", *ends) for name, ends in FILES.items()}


def velocity_torques(folder: Path, result: Result) -> Any:
    """Return the torques of the velocity forces, which give the coordinates the same accelerations."""
    free = asked(folder, result, None, {}, result.qd)
    model = LoadedModel(folder / "leg.osim", COORDINATES)
    state = model.state(result.q, 0.0 * result.qd)
    order, solver = model.order(state), osim.InverseDynamicsSolver(model.model)
    moved = np.zeros(len(order))
    moved[order] = [free[name]["velocity"][0] for name in COORDINATES]
    wanted = [numbers(solver.solve(state, osim.Vector.createFromMat(a))) for a in (moved, 0.0 * moved)]
    return np.subtract(*wanted)[order]


@pytest.mark.parametrize("sample", [0, 47, 100])
def test_each_source_accelerates_what_opensim_says(answered: tuple[Path, str], sample: int) -> None:
    folder, kind = answered
    result = Result(folder / "out", sample)
    start, way = np.array(CENTRE_OF_PRESSURE).T
    foot = None
    if kind != "swings":
        at = in_foot(folder, result, start + way * result.time)
        foot = Foot("body3", at, kind == "stuck", kind == "rolls")
    torques = {"motor": result.tau, "by_speed": velocity_torques(folder, result)}
    free, held = (asked(folder, result, one, torques, result.qd) for one in (None, foot))
    for name, shares in result.shares.items():
        expected = {joint: held[name][f"motor_{joint}"] for joint in COORDINATES}
        expected["gravity"] = held[name]["gravity"]
        both = [sum(part[name][f"by_speed_{joint}"] for joint in COORDINATES) for part in (free, held)]
        expected["velocity"] = free[name]["velocity"] - both[0] + both[1]
        own = {source: share for source, share in shares.items() if source.startswith("contact_")}
        assert shares.keys() == {"total", *expected, *own}
        assert list(own) == ([] if foot is None else ["contact_sole"])
        found = np.array([shares[source] for source in expected])
        assert relative_error(found, np.array([*expected.values()])) <= LIMIT
        scale = max(np.abs(found).max(), 1.0)
        whole = sum(expected.values()) + sum(own.values())
        assert np.abs(shares["total"] - whole).max() <= LIMIT * scale
        if foot is None:
            assert np.abs(shares["total"] - free[name]["total"] + both[0]).max() <= LIMIT * scale


def in_foot(folder: Path, result: Result, place: Any) -> tuple[float, float, float]:
    """Return a place of the ground in the axes of the foot."""
    model = LoadedModel(folder / "leg.osim", COORDINATES)
    state = model.state(result.q, result.qd)
    ground, foot = model.model.getGround(), model.body("body3")
    found = ground.findStationLocationInAnotherFrame(state, osim.Vec3(*place), foot)
    return found.get(0), found.get(1), found.get(2)


def test_opensim_reads_the_files_as_its_own(answered: tuple[Path, str]) -> None:
    folder, _ = answered
    table = osim.TimeSeriesTable(str(folder / "out" / "walk_InducedAccelerations_body3.sto"))
    assert table.getNumRows() == 101
    assert list(table.getColumnLabels())[:6] == [
        "total" + end for end in ("_X", "_Y", "_Z", "_Ox", "_Oy", "_Oz")
    ]
