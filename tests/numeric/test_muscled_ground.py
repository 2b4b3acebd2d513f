"""Muscles of a leg that stands, and studies of muscles and of markers, from files to tables."""

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest
from helpers.answers import relative_error
from helpers.command_line import run_linkwise
from helpers.muscled_leg import COORDINATES, MUSCLES, built, forces, motion, write_sto
from linkwise import Muscles, kept_package
from linkwise.analysis import analyze
from linkwise.analysis.contacts import Contacts
from linkwise_runtime.quantities import Contact

pytest.importorskip(
    "opensim", reason="needs opensim, which has wheels for Linux on x86-64: pip install opensim"
)
import opensim as osim

TOE, STEP = (0.0, -0.05, 0.0), 1e-6
STUDY = """schema = 1
name = "leg"
factors = ["way"]
columns = ["tau*/*", "tau*/*/*"]
pages = false

[analysis]
cutoff = 8.0

[[trial]]
name = "pulled"
subject = "a"
way = "muscles"
log = "motion.sto"
robot = "leg.osim"
muscles = "force.sto"
muscle_group = ["front=wrapping,moving"]

[[trial]]
name = "seen"
subject = "b"
way = "markers"
log = "walk.trc"
robot = "leg.osim"
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A model, its motion and the forces of its muscles."""
    osim.Logger.removeFileSink()
    osim.Logger.setLevelString("Off")
    made = tmp_path_factory.mktemp("ground")
    built(osim, made / "leg.osim")
    time, q = motion(61)
    write_sto(made / "motion.sto", COORDINATES, time, q)
    write_sto(made / "force.sto", MUSCLES, time, forces(time))
    return made


class Standing:
    """The leg in OpenSim with its toe at a place on the ground, which bears forces but no moment."""

    def __init__(self, file: Path, joints: tuple[str, ...]) -> None:
        self.model = osim.Model(str(file))
        self.state = self.model.initSystem()
        self.each = [self.model.getCoordinateSet().get(name) for name in joints]

    def _toe(self, q: np.ndarray) -> Any:
        for coordinate, value in zip(self.each, q, strict=True):
            coordinate.setValue(self.state, float(value), False)
        self.model.realizePosition(self.state)
        foot = self.model.getBodySet().get("foot")
        return foot.findStationLocationInGround(self.state, osim.Vec3(*TOE)).to_numpy()[:2].copy()

    def accelerated(self, q: np.ndarray, torques: np.ndarray) -> np.ndarray:
        """Accelerations (n, E) by torques (n, E): M a + Jᵀ f = torques, J a = 0."""
        held = np.array([self._toe(q + way) - self._toe(q - way) for way in STEP * np.eye(len(q))])
        held = held.T / (2 * STEP)
        self._toe(q)
        moved = osim.Matrix()
        self.model.getMatterSubsystem().calcM(self.state, moved)
        n, rows = len(q), len(held)
        mass = [[moved.get(row, column) for column in range(n)] for row in range(n)]
        whole = np.block([[np.array(mass), held.T], [held, np.zeros((rows, rows))]])
        return np.linalg.solve(whole, np.concatenate([torques, np.zeros((rows, torques.shape[1]))]))[:n]


def test_muscles_of_a_standing_leg_accelerate_it_as_in_opensim(folder: Path) -> None:
    muscles = Muscles(folder / "force.sto", folder / "leg.osim")
    held = Contacts((Contact("foot", "point", TOE, name="toe"),), unactuated=("slide",))
    log, package = folder / "motion.sto", kept_package(folder / "leg.osim")
    result = analyze(log, package, muscles=muscles, contacts=held, induced=["joints"])
    free, bare = analyze(log, package, muscles=muscles), analyze(log, package, contacts=held)
    before = result.dense("tau_before_muscles")
    assert relative_error(before, bare.torque) <= 1e-12
    assert relative_error(result.torque, before + result.load_torque.sum(axis=2)) <= 1e-12
    there = Standing(folder / "leg.osim", result.robot.joints)
    wanted = [there.accelerated(q, -pull) for q, pull in zip(result.q, free.load_torque, strict=True)]
    assert relative_error(result.dense("acc_load")[:, 0], np.array(wanted)) <= 1e-6


def test_a_study_of_muscles_and_of_markers_has_the_numbers_of_single_analyses(folder: Path) -> None:
    _write_markers(folder)
    (folder / "study.toml").write_text(STUDY)
    told = run_linkwise("study", "study.toml", "--out", "out", folder=folder)
    usual = osim.IO.GetPrecision()
    osim.IO.SetPrecision(5)  # in this process, which analyzes, and not in the study's
    assert told.returncode == 0, told.stderr
    table = pd.read_parquet(folder / "out/trials")
    for name, more in (
        ("pulled", ["motion.sto", "--muscles", "force.sto", "--muscle-group", "front=wrapping,moving"]),
        ("seen", ["walk.trc"]),
    ):
        given = "--robot", "leg.osim", "--cutoff", "8", "--no-page", "--out", name, "--format", "parquet"
        alone = run_linkwise("analyze", *more, *given, folder=folder)
        assert alone.returncode == 0, alone.stderr
        wanted = pd.read_parquet(folder / name / "analysis.parquet")
        found = table[table["trial"] == name]
        kept = [column for column in wanted if column.startswith(("tau/", "tau_before", "tau_load"))]
        assert kept
        assert relative_error(found[kept].to_numpy(), wanted[kept].to_numpy()) <= 1e-12
    osim.IO.SetPrecision(usual)
    assert table["tau_load/knee/front"].notna().sum() == (table["trial"] == "pulled").sum()


def _write_markers(folder: Path) -> None:
    model = osim.Model(str(folder / "leg.osim"))
    state = model.initSystem()
    markers = [model.getMarkerSet().get(at) for at in range(model.getMarkerSet().getSize())]
    table = osim.TimeSeriesTableVec3()
    table.setColumnLabels([one.getName() for one in markers])
    time, q = motion(61)
    for at, values in zip(time, q, strict=True):
        for name, value in zip(COORDINATES, values, strict=True):
            model.getCoordinateSet().get(name).setValue(state, float(value), False)
        model.realizePosition(state)
        table.appendRow(float(at), osim.RowVectorVec3([one.getLocationInGround(state) for one in markers]))
    table.addTableMetaDataString("DataRate", "100")
    table.addTableMetaDataString("Units", "m")
    osim.TRCFileAdapter.write(table, str(folder / "walk.trc"))
