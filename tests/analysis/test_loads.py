"""Loads from outside in an analysis: forces and moments on bodies, causes of their own."""

import json
from pathlib import Path

import numpy as np
import pyarrow
import pytest
from conftest import DATA
from helpers.motion_logs import LEG, smooth, write_csv, write_mot
from helpers.urdf_text import joint, link, robot
from linkwise import Load, generate, read_system, write_package
from linkwise.analysis import analyze
from linkwise.analysis.filtering import padding_length
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.loads import Loads
from linkwise.analysis.request import Outputs, Request
from linkwise.analysis.run import analyze_to
from linkwise.errors import LinkwiseError
from linkwise.progress import silent
from pyarrow import parquet
from scipy.signal import butter, sosfiltfilt

ARM = robot(
    *map(link, "abcd"),
    '<link name="tool"/>',
    joint("ab", "a", "b"),
    joint("bc", "b", "c", type="prismatic"),
    joint("cd", "c", "d"),
    joint("fixed", "d", "tool", type="fixed"),
)
JOINTS = ["ab", "bc", "cd"]
FORCE = [f"tool/force_{axis}" for axis in "xyz"]
WRENCH = [f"hand:tool/{part}_{axis}" for part in ("force", "moment", "point") for axis in "xyz"]


@pytest.fixture(scope="module")
def arm(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("loads")
    (folder / "arm.urdf").write_text(ARM)
    write_package(generate(read_system(folder / "arm.urdf"), ["numpy", "torch"]), folder / "arm")
    write_csv(folder / "log.csv", smooth(60, 3), JOINTS)
    return folder


def measured(samples: int = 701, rate: float = 1000.0, columns: int = 9) -> np.ndarray:
    """A log of loads with a clock of its own."""
    time = np.arange(samples) / rate
    at = np.arange(columns)
    return np.column_stack([time, 20 * np.sin((3 + at) * time[:, None] + at)])


class Pinocchio:
    """Inverse dynamics with wrenches on points of bodies' frames; all in the world's axes."""

    def __init__(self, path: Path) -> None:
        self.pin = pytest.importorskip("pinocchio")
        self.model = self.pin.buildModelFromUrdf(str(path))
        self.data = self.model.createData()

    def pose(self, body, q):
        self.pin.framesForwardKinematics(self.model, self.data, q)
        return self.data.oMf[self.model.getFrameId(body, self.pin.BODY)]

    def share(self, body, motion, force, moment, place):
        """Return what the wrench adds to the torques."""
        pin, model = self.pin, self.model
        self.pose(body, motion[0])
        carrier = model.frames[model.getFrameId(body, pin.BODY)].parentJoint
        loads = pin.StdVec_Force()
        loads.extend([pin.Force.Zero()] * model.njoints)
        loads[carrier] = self.data.oMi[carrier].actInv(pin.Force(force, moment + np.cross(place, force)))
        return pin.rnea(model, self.data, *motion, loads) - pin.rnea(model, self.data, *motion)


@pytest.mark.parametrize("backend", ["numpy", "torch"])
def test_loads_are_what_pinocchios_external_forces_are(arm: Path, tmp_path: Path, backend: str) -> None:
    oracle = Pinocchio(arm / "arm.urdf")
    table = measured()
    file = write_csv(tmp_path / "plate.csv", table, WRENCH)
    force, moment, point = np.array([3.0, -2.0, 5.0]), np.array([0.3, 0.1, -0.4]), np.array([0.1, 0.2, 0.3])
    given = [
        Load("pull", "c", force, moment, point),
        Load("thrust", "tool", force, moment, point, axes="tool"),
        Load("rope", "d", force, point=point, point_in="b"),
        Load("turn", "b", moment=moment),
    ]
    result = analyze(arm / "log.csv", load_robot(arm / "arm", backend), loads=[*given, file])
    assert [borne.name for borne in result.loads] == ["pull", "thrust", "rope", "turn", "hand"]
    every = np.zeros_like(result.torque)
    for s, motion in enumerate(zip(result.q, result.qd, result.qdd, strict=True)):
        row = np.array([np.interp(result.time[s], table[:, 0], column) for column in table.T])[1:]
        tool, b, c = (oracle.pose(body, motion[0]).copy() for body in ("tool", "b", "c"))
        expected = [
            oracle.share("c", motion, force, moment, c.act(point)),
            oracle.share("tool", motion, tool.rotation @ force, tool.rotation @ moment, tool.act(point)),
            oracle.share("d", motion, force, np.zeros(3), b.act(point)),
            oracle.share("b", motion, np.zeros(3), moment, np.zeros(3)),
            oracle.share("tool", motion, row[:3], row[3:6], row[6:]),
        ]
        np.testing.assert_allclose(result.load_torque[s].T, expected, rtol=0, atol=1e-10)
        own = oracle.pin.rnea(oracle.model, oracle.data, *motion)
        every[s] = own + np.sum(expected, axis=0)
    np.testing.assert_allclose(result.torque, every, rtol=0, atol=1e-10)
    assert result.closure.links_relative < 1e-13
    assert result.closure.recursion_relative < 1e-12


def test_between_samples_the_wrench_about_the_origin_is_linear(arm: Path, tmp_path: Path) -> None:
    table = measured(20, 25.0)
    result = analyze(arm / "log.csv", arm / "arm", loads=[write_csv(tmp_path / "a.csv", table, WRENCH)])
    force, moment, point = table[:, 1:4], table[:, 4:7], table[:, 7:]
    moment = moment + np.cross(point, force)
    same = Load("same", "tool", force, moment, (0, 0, 0), table[:, 0], point_in="world")
    other = analyze(arm / "log.csv", arm / "arm", loads=[same])
    np.testing.assert_allclose(result.load_torque, other.load_torque, rtol=0, atol=1e-11)


def test_a_leg_that_stands_on_its_foot_needs_no_force_at_the_pelvis(tmp_path: Path) -> None:
    write_package(generate(read_system(LEG), ["numpy"]), tmp_path / "leg")
    leg = load_robot(tmp_path / "leg")
    weight = 9.80665 * (50.85 + 7.5 + 3.49 + 1.09)
    q = np.zeros((50, 7))
    q[:, 0] = np.arange(50) / 100
    q[:, 2:] = [0.93, 0.1, 0.5, -0.6, 0.2]
    names = list(leg.joints)
    log = write_csv(tmp_path / "stand.csv", q, names)
    centre = np.asarray(leg.model.kinematics.centre_of_mass(q[0, 1:]))
    ground = Load("ground", "foot", (0, weight, 0), point=(centre[0], 0, 0), point_in="ground")
    result = analyze(log, leg, loads=[ground])
    np.testing.assert_allclose(result.torque[:, :3], 0, atol=1e-9)
    assert names[:3] == ["pelvis_tx", "pelvis_ty", "pelvis_tilt"]
    assert np.abs(result.torque[:, 3:]).min() > 10
    assert (result["tau_load/pelvis_ty/ground"] < -600).all()


def test_tables_record_and_pictures_have_each_load(arm: Path, tmp_path: Path) -> None:
    file = write_mot(tmp_path / "plate.mot", measured(columns=3), FORCE)
    wanted = Outputs("csv", ("shares", "paper", "power"), page=True)
    loads = Loads.of([file])
    result, _ = analyze_to(
        tmp_path / "out",
        arm / "log.csv",
        load_robot(arm / "arm"),
        Request(outputs=wanted, loads=loads),
        silent,
    )
    header = (tmp_path / "out/analysis.csv").read_text().splitlines()[0].split(",")
    assert {f"{what}/{name}/tool" for what in ("tau_load", "power_load") for name in JOINTS} <= set(header)
    record = json.loads((tmp_path / "out/analysis.json").read_text())
    assert record["loads"] == [{"name": "tool", "body": "tool", "file": "plate.mot", "cutoff": None}]
    borne = {entry["joint"]: entry["net"] for entry in record["work"]["against_loads"]}
    power = result["tau_load/cd/tool"] * result.qd[:, 2]
    np.testing.assert_allclose(borne["cd"], np.trapezoid(power, result.time), rtol=1e-9)
    labels = [text.get_text() for text in result.figure("shares").legends[0].get_texts()]
    assert labels[:2] == ["gravity", "load tool"]


def test_a_low_pass_is_run_over_the_whole_log_of_loads(arm: Path, tmp_path: Path) -> None:
    """Over forces and their moments about the world's origin, as a plate has them."""
    table = measured()
    file = write_csv(tmp_path / "plate.csv", table, WRENCH)
    result = analyze(arm / "log.csv", arm / "arm", loads=[file], loads_cutoff=30.0)
    assert "loads filtered at 30 Hz" in result.provenance
    sos = butter(2, 30.0, fs=1000.0, output="sos")
    time, force, moment, point = np.split(table, [1, 4, 7], axis=1)
    wrench = np.hstack([force, moment + np.cross(point, force)])
    smooth_force, about_origin = np.split(
        sosfiltfilt(sos, wrench, axis=0, padlen=padding_length(sos, len(table))), 2, axis=1
    )
    same = Load("f", "tool", smooth_force, about_origin, time=time[:, 0], point_in="world")
    expected = analyze(arm / "log.csv", arm / "arm", loads=[same])
    np.testing.assert_allclose(result.load_torque, expected.load_torque, rtol=0, atol=1e-10)


def gap(table: np.ndarray) -> np.ndarray:
    return np.delete(table, slice(100, 103), axis=0)


def hole(table: np.ndarray) -> np.ndarray:
    table[41, 2] = np.nan
    return table


REFUSED = {
    "gap": (gap, FORCE, r"plate.csv: rows 101 to 102, time column: a gap of 0.004 s where steps are 0.001 s"),
    "hole": (hole, FORCE, r"plate.csv: row 43, column 'tool/force_y': nan is not a sample; fill the gap"),
    "short": (
        lambda table: table[:300],
        FORCE,
        r"plate.csv: row 301, time column: it ends at 0.299 s, the motion at 0.59 s; analyse less",
    ),
    "late": (
        lambda table: table[50:],
        FORCE,
        r"plate.csv: row 2, time column: it begins at 0.05 s, the motion at 0 s; analyse less",
    ),
    "body": (
        lambda table: table,
        [name.replace("tool", "tol") for name in FORCE],
        r"plate.csv: load 'tol' on 'tol': test has no such body; its bodies are tool, a, b, c, d",
    ),
    "ground": (
        lambda table: table,
        [name.replace("tool", "a") for name in FORCE],
        r"plate.csv: load 'a' on 'a': that stands on the ground, so that no joint bears it",
    ),
    "axis": (
        lambda table: table[:, :3],
        FORCE[:2],
        r"plate.csv: no column 'tool/force_z' .found 'tool/force_x'.*; a load has x, y and z of what it has",
    ),
    "point": (
        lambda table: table,
        [name.replace("force", "point") for name in FORCE],
        r"plate.csv: load 'tool' has a point and neither force nor moment; add tool/force_x, …",
    ),
    "extra": (
        lambda table: table,
        [*FORCE[:2], "tool/fz"],
        r"plate.csv: no load for column 'tool/fz'; name columns BODY/force_x, .* or leave .* --ignore-extra",
    ),
    "none": (
        lambda table: table,
        ["fx", "fy", "fz"],
        r"plate.csv: no column of a load in 'time', 'fx', 'fy', 'fz'; name them BODY/force_x",
    ),
}


@pytest.mark.parametrize("case", REFUSED)
def test_a_log_of_loads_that_lacks_something_is_refused(arm: Path, tmp_path: Path, case: str) -> None:
    change, names, message = REFUSED[case]
    file = write_csv(tmp_path / "plate.csv", change(measured(columns=3)), names)
    with pytest.raises(LinkwiseError, match=message):
        analyze(arm / "log.csv", arm / "arm", loads=[file])


def test_robots_of_energies_bear_no_loads(tmp_path: Path) -> None:
    write_package(generate(read_system(str(DATA / "cart_pendulum.py")), ["numpy"]), tmp_path / "cart")
    cart = load_robot(tmp_path / "cart")
    log = write_csv(tmp_path / "log.csv", smooth(20, len(cart.joints)), cart.joints)
    with pytest.raises(
        LinkwiseError, match=r"load 'f' on 'pole': the links of .* are energies, which do not"
    ):
        analyze(log, cart, loads=[Load("f", "pole")])


def test_values_that_are_no_load_are_refused(arm: Path) -> None:
    for load, message in (
        (Load("f", "tool", (1, 2)), r"load 'f': force has shape \(2,\); give \(3,\), or time beside it"),
        (
            Load("f", "tool", np.zeros((4, 3)), time=np.arange(5)),
            r"force has shape \(4, 3\); give .* \(5, 3\)",
        ),
        (Load("f", "tool", time=np.zeros((2, 3))), r"load 'f': time has shape \(2, 3\); give \(S,\), in s"),
        (Load("f", "tool", time=[]), r"load 'f': time has shape \(0,\); give \(S,\), in s"),
        (Load("f", "tool", (1, 2, np.inf)), r"load 'f': a value is not finite; fill the gap"),
        (Load("f", "tool", time=np.array([0.0, 1.0, 0.5])), r"load 'f': row 3, time column: time runs back"),
        (Load("f", "tool", axes="tol"), r"load 'f', given in the axes of 'tol': test has no such body"),
    ):
        with pytest.raises(LinkwiseError, match=message):
            analyze(arm / "log.csv", arm / "arm", loads=[load])
    with pytest.raises(LinkwiseError, match="load 'f': another has that name"):
        analyze(arm / "log.csv", arm / "arm", loads=[Load("f", "tool"), Load("f", "d")])
    with pytest.raises(
        LinkwiseError, match="--loads-cutoff goes with --loads, or with --contact-loads; add one"
    ):
        Loads.of([], 5.0)


@pytest.mark.parametrize("suffix", [".csv", ".mot", ".parquet"])
def test_a_column_of_a_load_that_is_given_twice_is_refused(arm: Path, tmp_path: Path, suffix: str) -> None:
    names, path = [*FORCE, FORCE[0]], tmp_path / f"plate{suffix}"
    if suffix == ".parquet":
        columns = [pyarrow.array(column) for column in measured(columns=4).T]
        parquet.write_table(pyarrow.Table.from_arrays(columns, names=["time", *names]), path)
    else:
        (write_csv if suffix == ".csv" else write_mot)(path, measured(columns=4), names)
    with pytest.raises(
        LinkwiseError, match=rf"^{path}: columns 2 and 5 are both named 'tool/force_x'; rename"
    ):
        analyze(arm / "log.csv", arm / "arm", loads=[path])
