"""From markers and plates to torques: OpenSim's inverse kinematics, and C3D files that ezc3d writes."""

import json
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.answers import relative_error
from helpers.command_line import run_linkwise
from helpers.muscled_leg import COORDINATES, built, motion, write_sto
from linkwise import Analysis, Load, MarkerChoices, kept_package
from linkwise.analysis import Lowpass, Processing, analyze
from linkwise.analysis.opensim.recorded_markers import recorded_markers
from linkwise.errors import LinkwiseError

pytest.importorskip(
    "opensim", reason="needs opensim, which has wheels for Linux on x86-64: pip install opensim"
)
import opensim as osim

ezc3d: Any = pytest.importorskip("ezc3d")

LAB = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""From the model's axes, y up, to those of a laboratory, z up."""
PLATE = np.diag([1.0, -1.0, -1.0])
"""From the laboratory's axes to those of the plate, whose z points down, and back."""
SMOOTH = Processing(lowpass=Lowpass(8.0))


class Walk:
    """A known motion of the leg, its markers and what the ground gives to the foot."""

    def __init__(self, folder: Path) -> None:
        osim.Logger.removeFileSink()
        osim.Logger.setLevelString("Off")
        self.folder, self.file = folder, folder / "leg.osim"
        built(osim, self.file)
        self.time, self.q = motion(121)
        write_sto(folder / "known.sto", COORDINATES, self.time, self.q)
        self.names, self.markers = self._seen()
        swing = np.sin(4 * self.time)
        self.force = np.column_stack([20 * swing, 600 + 50 * swing, 10 * swing])
        self.centre = np.column_stack([0.1 + 0.02 * swing, 0 * swing, 0.05 + 0.01 * swing])
        self.free = np.column_stack([0 * swing, 2 + swing, 0 * swing])

    def _seen(self) -> tuple[list[str], np.ndarray]:
        model = osim.Model(str(self.file))
        state = model.initSystem()
        there = [model.getMarkerSet().get(at) for at in range(model.getMarkerSet().getSize())]
        found = []
        for q in self.q:
            for name, value in zip(COORDINATES, q, strict=True):
                model.getCoordinateSet().get(name).setValue(state, float(value), False)
            model.realizePosition(state)
            found.append([one.getLocationInGround(state).to_numpy() for one in there])
        return [one.getName() for one in there], np.array(found)

    def known(self, **more: Any) -> Analysis:
        return analyze(self.folder / "known.sto", kept_package(self.file), processing=SMOOTH, **more)

    def followed(self, log: Path, *plates: str, **more: Any) -> Analysis:
        choices = MarkerChoices(self.file, plates=plates, **more)
        return analyze(log, kept_package(self.file), processing=SMOOTH, markers=choices)

    def load(self) -> Load:
        """Load of the plate on the foot, at its centre of pressure."""
        return Load("plate 1", "foot", self.force, self.free, self.centre, self.time, point_in="world")

    def trc(self, path: Path, markers: np.ndarray, at: np.ndarray) -> None:
        """Write markers (S, M, 3) at instants (S,) in m; NaN for what is not seen."""
        table = osim.TimeSeriesTableVec3()
        table.setColumnLabels(self.names)
        for time, places in zip(at, markers, strict=True):
            table.appendRow(float(time), osim.RowVectorVec3([osim.Vec3(*map(float, x)) for x in places]))
        table.addTableMetaDataString("DataRate", f"{1 / (at[1] - at[0]):.6g}")
        table.addTableMetaDataString("Units", "m")
        osim.TRCFileAdapter.write(table, str(path))

    def c3d(self, path: Path, sign: float = 1.0, screen: bool = True, names: list[str] | None = None) -> None:
        """Write markers in mm and a plate of type 2, in a laboratory whose z is up; sign: of its forces."""
        file, points, count = ezc3d.c3d(), file_points(self.markers), len(self.time)
        file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
        file["parameters"]["POINT"]["LABELS"]["value"] = names or self.names
        file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
        if screen:
            file.add_parameter("POINT", "X_SCREEN", ["+X"])
            file.add_parameter("POINT", "Y_SCREEN", ["+Z"])
        file["data"]["points"] = points
        force, free, centre = (a @ LAB.T for a in (self.force, self.free, self.centre))
        middle, below = np.array([0.2, 0.1, 0.0]), np.array([0.0, 0.0, -0.04])
        moment = free + np.cross(centre - middle - below, force)
        channels = sign * np.concatenate([force @ PLATE, 1000 * moment @ PLATE], axis=1).T
        for name, value in {
            "LABELS": ["Fx", "Fy", "Fz", "Mx", "My", "Mz"],
            "UNITS": ["N", "N", "N", "Nmm", "Nmm", "Nmm"],
            "SCALE": [1.0] * 6,
            "OFFSET": [0] * 6,
            "RATE": [100.0],
        }.items():
            file["parameters"]["ANALOG"][name]["value"] = value
        file["data"]["analogs"] = channels.reshape(1, 6, count)
        corners = 1000 * middle[:, None] + np.array([[200, -200, -200, 200], [-100, -100, 100, 100], [0] * 4])
        for name, value in {
            "USED": np.array([1]),
            "TYPE": np.array([2]),
            "ZERO": np.array([0, 0]),
            "CORNERS": corners[:, :, None].astype(float),
            "ORIGIN": -1000 * PLATE @ below[:, None],  # from where moments are taken to the surface
            "CHANNEL": np.arange(1, 7)[:, None],
        }.items():
            file["parameters"]["FORCE_PLATFORM"][name]["value"] = value
        file.write(str(path))


def file_points(markers: np.ndarray) -> np.ndarray:
    """Markers (S, M, 3) in m as a C3D file has them: (4, M, S) in mm."""
    found = np.ones((4, markers.shape[1], len(markers)))
    found[:3] = 1000 * np.moveaxis(markers @ LAB.T, 0, 2).transpose(1, 0, 2)
    return found


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> Walk:
    made = Walk(tmp_path_factory.mktemp("markers"))
    made.c3d(made.folder / "walk.c3d")
    return made


def test_markers_and_a_plate_give_the_torques_of_the_known_motion(walk: Walk) -> None:
    found, wanted = walk.followed(walk.folder / "walk.c3d", "1=foot"), walk.known(loads=[walk.load()])
    assert found.time == pytest.approx(wanted.time)
    assert np.abs(found.q - wanted.q).max() < 1e-4
    assert relative_error(found.load_torque, wanted.load_torque) < 1e-3
    inside = slice(6, -6)  # one-sided derivatives magnify what single precision of the file rounds
    assert relative_error(found.torque[inside], wanted.torque[inside]) < 1e-3
    assert np.abs(wanted.torque).max() > 100.0


def test_a_plate_may_have_a_name_and_its_filter_is_recorded(walk: Walk) -> None:
    found = walk.followed(walk.folder / "walk.c3d", "right:1=foot", cutoff=12.0)
    record = found.record()
    assert record["loads"] == [{"name": "right", "body": "foot", "file": "walk.c3d", "cutoff": 12.0}]
    plate = {"name": "right", "number": 1, "body": "foot", "bare_below": 20.0}
    assert record["markers"]["plates"] == [plate]
    for text in ("1:=foot", ":1=foot", "right:=foot", "right=foot"):
        with pytest.raises(LinkwiseError, match="or NAME:NUMBER=BODY"):
            walk.followed(walk.folder / "walk.c3d", text)


def test_a_filtered_plate_keeps_the_force_as_measured(walk: Walk) -> None:
    filtered, plain = (
        walk.followed(walk.folder / "walk.c3d", "1=foot", **how) for how in ({"cutoff": 1.0}, {})
    )
    smooth, before, alone = (
        one.wrenches[0].table for one in (filtered.loads[0], filtered.loads[0].as_measured, plain.loads[0])
    )
    assert np.array_equal(before, alone)
    assert np.abs(smooth - alone).max() > 1.0


def test_forces_on_the_plate_are_turned_round(walk: Walk, tmp_path: Path) -> None:
    walk.c3d(tmp_path / "down.c3d", sign=-1.0)
    found, wanted = walk.followed(tmp_path / "down.c3d", "1=foot"), walk.known(loads=[walk.load()])
    assert relative_error(found.load_torque, wanted.load_torque) < 1e-3
    assert any("are turned round" in warning for warning in found.warnings)


def test_errors_of_markers_are_told(walk: Walk, tmp_path: Path) -> None:
    names = list(walk.names)
    names[0] = "heel"  # a marker that the model lacks
    walk.c3d(tmp_path / "named.c3d", names=names)
    result = walk.followed(tmp_path / "named.c3d")
    told = result.record()["markers"]
    assert told["lacking"] == [walk.names[0]]
    assert told["unknown"] == ["heel"]
    assert told["root_mean_square"] < 1e-4
    assert {one["marker"] for one in told["each"]} == {*walk.names[1:]}
    assert any("plate 1 bears up to" in warning for warning in result.warnings)
    moved = walk.markers.copy()
    walk.markers[30, 4, 2] += 0.03  # 3 cm out of the leg's plane, where no joint follows
    try:
        walk.c3d(tmp_path / "off.c3d")
    finally:
        walk.markers[:] = moved
    largest = walk.followed(tmp_path / "off.c3d").record()["markers"]["largest"]
    assert largest["marker"] == walk.names[4]
    assert largest["time"] == pytest.approx(0.3)
    assert largest["error"] == pytest.approx(0.03, rel=0.05)


def test_distances_are_of_the_same_instant_at_a_rate_whose_step_is_rounded(
    walk: Walk, tmp_path: Path
) -> None:
    """A sixtieth of a second has no end in decimals, and the motion's file has some of them."""
    walk.trc(tmp_path / "walk.trc", walk.markers, np.arange(len(walk.time)) / 60)
    told = walk.followed(tmp_path / "walk.trc").record()["markers"]
    assert told["largest"]["error"] < 1e-5
    assert np.abs(np.diff(walk.markers, axis=0)).max() > 0.01, "from one instant to the next"


def test_a_marker_that_is_never_seen_is_lacking(walk: Walk, tmp_path: Path) -> None:
    unseen = walk.markers.copy()
    unseen[:, 2] = np.nan
    unseen[20:30, 5, 1] = np.nan  # one coordinate of it
    walk.trc(tmp_path / "unseen.trc", unseen, walk.time)
    result = walk.followed(tmp_path / "unseen.trc")
    told = json.loads(json.dumps(result.record()["markers"], allow_nan=False))
    assert told["lacking"] == [walk.names[2]]
    assert {one["marker"] for one in told["each"]} == {*walk.names} - {walk.names[2]}
    assert np.abs(result.q - walk.known().q).max() < 1e-4


def test_a_marker_that_lacks_a_coordinate_is_not_seen() -> None:
    places = np.ones((2, 3, 3))
    places[0, 1, 2], places[1, 2] = np.nan, 0.0
    found = recorded_markers(np.arange(2.0), "abc", places, str)
    assert np.isnan(found.places).all(axis=2).tolist() == [[False, True, False], [False, False, True]]
    assert np.isnan(found.places).any(axis=2).tolist() == [[False, True, False], [False, False, True]]


def test_joints_that_no_seen_marker_tells_are_named_with_the_time(walk: Walk, tmp_path: Path) -> None:
    """OpenSim holds them where they were, and its markers are all met."""
    foot = [at for at, name in enumerate(walk.names) if name.startswith("foot")]
    unseen = walk.markers.copy()
    unseen[20:30, foot[1:]] = np.nan
    walk.trc(tmp_path / "one.trc", unseen, walk.time)
    assert not any("no marker" in line for line in walk.followed(tmp_path / "one.trc").warnings)
    unseen[20:30, foot[0]] = np.nan
    walk.trc(tmp_path / "none.trc", unseen, walk.time)
    result = walk.followed(tmp_path / "none.trc")
    assert result.record()["markers"]["root_mean_square"] < 1e-6
    (told,) = (line for line in result.warnings if "no marker" in line)
    assert "no marker that is seen tells ankle in 10 frames between 0.2 and 0.29 s" in told
    unseen[:, foot] = np.nan
    walk.trc(tmp_path / "never.trc", unseen, walk.time)
    (told,) = (line for line in walk.followed(tmp_path / "never.trc").warnings if "no marker" in line)
    assert "no marker tells ankle: what they are is OpenSim's" in told
    unseen[20:30] = np.nan
    walk.trc(tmp_path / "blind.trc", unseen, walk.time)
    with pytest.raises(LinkwiseError, match=r"none .* is seen in 10 frames between 0\.2 and 0\.29 s; fill"):
        walk.followed(tmp_path / "blind.trc")


def test_a_coordinate_with_a_task_of_its_own_is_told_by_that(walk: Walk, tmp_path: Path) -> None:
    tasks = osim.IKTaskSet()
    for name in walk.names:
        if not name.startswith("foot"):
            task = osim.IKMarkerTask()
            task.setName(name)
            task.setWeight(1.0)
            tasks.cloneAndAppend(task)
    tasks.printToXML(str(tmp_path / "markers.xml"))
    own = osim.IKCoordinateTask()
    own.setName("ankle")
    own.setValueType(osim.IKCoordinateTask.ManualValue)
    own.setValue(0.1)
    own.setWeight(1.0)
    tasks.cloneAndAppend(own)
    tasks.printToXML(str(tmp_path / "both.xml"))
    for file, is_told in (("markers.xml", True), ("both.xml", False)):
        found = walk.followed(walk.folder / "walk.c3d", tasks=tmp_path / file).warnings
        assert any("no marker tells ankle" in line for line in found) == is_told


def test_a_marker_at_the_origin_is_not_seen_in_text_either(walk: Walk, tmp_path: Path) -> None:
    zeros = walk.markers.copy()
    zeros[20:30, 5] = 0.0
    walk.trc(tmp_path / "zeros.trc", zeros, walk.time)
    result = walk.followed(tmp_path / "zeros.trc")
    assert np.abs(result.q - walk.known().q).max() < 1e-4
    assert any(f"not seen there: {walk.names[5]}" in line for line in result.warnings)


def test_a_head_that_is_not_of_its_rows_is_told(walk: Walk, tmp_path: Path) -> None:
    walk.trc(tmp_path / "walk.trc", walk.markers, walk.time)
    lines = (tmp_path / "walk.trc").read_text().splitlines(keepends=True)
    (tmp_path / "cut.trc").write_text("".join(lines[:-40]))
    found = walk.followed(tmp_path / "cut.trc").warnings
    assert any("its head says 121 frames, and 81 are there" in line for line in found)
    lines[2] = lines[2].replace("100", "200", 1)
    (tmp_path / "fast.trc").write_text("".join(lines))
    found = walk.followed(tmp_path / "fast.trc").warnings
    assert any("its head says 200 Hz, and its times 100 Hz, which are taken" in line for line in found)


def test_cells_and_rows_of_text_are_read_whole_or_refused_with_their_line(walk: Walk, tmp_path: Path) -> None:
    walk.trc(tmp_path / "walk.trc", walk.markers, walk.time)
    lines = (tmp_path / "walk.trc").read_text().splitlines(keepends=True)
    (tmp_path / "blank.trc").write_text("".join([*lines[:50], "\n", *lines[50:]]))
    assert walk.followed(tmp_path / "blank.trc").total == len(walk.time)
    frame, time, x, *rest = lines[50].split("\t")
    for cells, told in (
        ((time, "0.05abc"), "line 51: '0.05abc' is no number"),
        ((time, x.replace(".", ",")), "is no number; write a point in its place"),
        ((time, "inf"), "line 51: 'inf' is no number"),
        ((time, "1e300"), "line 51: a marker is farther than 10000 m away"),
        (("", x), "line 51: it has no time"),
        (("0", x), "line 51: its time is not after that of the row before it"),
        ((time, x, "0.1"), "line 51 has 39 cells, and 38 are those of its markers"),
    ):
        odd = "\t".join([frame, *cells, *rest]).replace("\t\n", "\n")
        (tmp_path / "odd.trc").write_text("".join([*lines[:50], odd, *lines[51:]]))
        with pytest.raises(LinkwiseError, match=re.escape(told)):
            walk.followed(tmp_path / "odd.trc")
    for text in (
        "".join(lines[1:]),
        "".join(lines[:7]),
        "".join(lines).replace(f"{walk.names[0]}\t", "\t", 1),
    ):
        (tmp_path / "head.trc").write_text(text)
        with pytest.raises(LinkwiseError, match=r"PathFileType|no motion|three columns for each"):
            walk.followed(tmp_path / "head.trc")


def test_what_tells_a_coordinate_hangs_on_the_pose(walk: Walk, tmp_path: Path) -> None:
    """Pelvis and foot alone tell hip, knee and ankle while the knee is bent, and not while it is straight."""
    leg = [at for at, name in enumerate(walk.names) if name.startswith(("thigh", "shank"))]
    held = walk.q.copy(), walk.markers.copy()
    unseen = {"straight": slice(0, 10), "bent": slice(50, 70)}
    try:
        walk.q[:, COORDINATES.index("knee")] *= np.linspace(0, 1, len(walk.time)) ** 2 > 0.01
        walk.markers = walk._seen()[1]
        straight = np.abs(walk.q[:, COORDINATES.index("knee")]) < 1e-6
        assert straight[unseen["straight"]].all()
        assert not straight[unseen["bent"]].any()
        for name, when in unseen.items():
            markers = walk.markers.copy()
            markers[when.start : when.stop, leg] = np.nan
            walk.trc(tmp_path / f"{name}.trc", markers, walk.time)
    finally:
        walk.q, walk.markers = held
    for name, is_told in (("straight", True), ("bent", False)):
        warnings = walk.followed(tmp_path / f"{name}.trc").warnings
        assert any("no marker that is seen tells" in line for line in warnings) == is_told, name


def test_tasks_that_weigh_nothing_are_refused_and_none_at_all_are_all(walk: Walk, tmp_path: Path) -> None:
    def tasks(names: Sequence[str], weight: float = 1.0) -> Path:
        made = osim.IKTaskSet()
        for name in names:
            task = osim.IKMarkerTask()
            task.setName(name)
            task.setWeight(weight)
            made.cloneAndAppend(task)
        made.printToXML(str(tmp_path / "tasks.xml"))
        return tmp_path / "tasks.xml"

    log = walk.folder / "walk.c3d"
    assert not any("no marker" in line for line in walk.followed(log, tasks=tasks(())).warnings)
    for names, weight in ((["nose"], 1.0), (walk.names, 0.0)):
        with pytest.raises(LinkwiseError, match="none of its tasks is of a marker that model and recording"):
            walk.followed(log, tasks=tasks(names, weight))
    unseen = walk.markers.copy()
    unseen[20:30, 3:] = np.nan
    walk.trc(tmp_path / "blind.trc", unseen, walk.time)
    with pytest.raises(LinkwiseError, match="that have a task is seen in 10 frames between"):
        walk.followed(tmp_path / "blind.trc", tasks=tasks(walk.names[3:]))


def test_markers_far_from_the_models_are_told(walk: Walk, tmp_path: Path) -> None:
    walk.trc(tmp_path / "far.trc", 1.3 * walk.markers, walk.time)
    assert any("look at the unit, the names" in line for line in walk.followed(tmp_path / "far.trc").warnings)


def test_a_c3d_file_that_was_cut_short_is_refused(walk: Walk, tmp_path: Path) -> None:
    whole = (walk.folder / "walk.c3d").read_bytes()
    (tmp_path / "cut.c3d").write_bytes(whole[: len(whole) - 5000])
    with pytest.raises(
        LinkwiseError, match=r"cut\.c3d: its head says 121 frames, and \d+ are there: it was cut"
    ):
        walk.followed(tmp_path / "cut.c3d")


def test_what_a_plate_says_while_it_is_bare_counts_for_nothing(walk: Walk, tmp_path: Path) -> None:
    held = walk.force.copy()
    walk.force[:] = [0.0, -8.0, 0.0]  # as of a plate that is not at zero: more in sum than the one step
    walk.force[60] = [0.0, 300.0, 0.0]
    try:
        walk.c3d(tmp_path / "drift.c3d")
        walk.force[60] = [0.0, 10.0, 0.0]
        walk.c3d(tmp_path / "bare.c3d")
    finally:
        walk.force[:] = held
    found = walk.followed(tmp_path / "drift.c3d", "1=foot")
    assert not any("turned round" in line for line in found.warnings)
    bare = walk.followed(tmp_path / "bare.c3d", "1=foot")
    assert any("plate 1 never bears 20 N: it loads foot with nothing" in line for line in bare.warnings)


def test_gaps_of_a_plate_that_bears_something_are_refused(walk: Walk, tmp_path: Path) -> None:
    held = walk.force.copy(), walk.free.copy()
    walk.force[10:13] = 0.0, 5.0, 0.0  # less than 20 N
    walk.free[10:13] = np.nan
    try:
        walk.c3d(tmp_path / "idle.c3d")
        walk.force[50:53] = np.nan
        walk.c3d(tmp_path / "gaps.c3d")
    finally:
        walk.force[:], walk.free[:] = held
    found = walk.followed(tmp_path / "idle.c3d", "1=foot").load_torque
    assert np.isfinite(found).all()
    assert not found[11].any()
    with pytest.raises(
        LinkwiseError, match=r"gaps\.c3d: plate 1: 3 of its 121 samples .*, first the 51th; fill"
    ):
        walk.followed(tmp_path / "gaps.c3d", "1=foot")
    assert any("plate 1 bears up to" in line for line in walk.followed(tmp_path / "gaps.c3d").warnings)


def test_a_plate_that_nobody_asks_for_does_not_stop_the_others(walk: Walk, tmp_path: Path) -> None:
    for name, value, warned, refused in (
        ("TYPE", np.array([5]), "plate 1 is of type 5; types", "plate 1 is of type 5; types"),
        ("CORNERS", np.zeros((3, 4, 1)), "plate 1 bears up to", "CORNERS does not say where it is"),
    ):
        file = ezc3d.c3d(str(walk.folder / "walk.c3d"))
        file["parameters"]["FORCE_PLATFORM"][name]["value"] = value
        file.write(str(tmp_path / "odd.c3d"))
        found = walk.followed(tmp_path / "odd.c3d")
        assert len([line for line in found.warnings if warned in line]) == 1
        with pytest.raises(LinkwiseError, match=rf"odd\.c3d: plate 1.*{refused.removeprefix('plate 1')}"):
            walk.followed(tmp_path / "odd.c3d", "1=foot")


def test_weights_are_those_of_a_file(walk: Walk, tmp_path: Path) -> None:
    tasks = osim.IKTaskSet()
    for name in walk.names:
        task = osim.IKMarkerTask()
        task.setName(name)
        task.setWeight(1e-9 if name == "foot0" else 1.0)
        tasks.cloneAndAppend(task)
    tasks.printToXML(str(tmp_path / "tasks.xml"))
    held = walk.markers.copy()
    walk.markers[:, walk.names.index("foot0"), 0] += 0.05
    try:
        walk.c3d(tmp_path / "off.c3d")
    finally:
        walk.markers[:] = held
    wanted, there = walk.known().q, walk.followed(tmp_path / "off.c3d", tasks=tmp_path / "tasks.xml").q
    assert np.abs(there - wanted).max() < 1e-4
    assert np.abs(walk.followed(tmp_path / "off.c3d").q - wanted).max() > 0.01
    with pytest.raises(LinkwiseError, match="it is a Model; give a setup of inverse kinematics"):
        walk.followed(tmp_path / "off.c3d", tasks=walk.file)


def test_a_trc_file_is_analysed_by_the_command(walk: Walk, tmp_path: Path) -> None:
    walk.trc(tmp_path / "walk.trc", walk.markers, walk.time)
    out = tmp_path / "out"
    told = run_linkwise(
        *("analyze", tmp_path / "walk.trc", "--robot", walk.file, "--out", out, "--cutoff", "8", "--no-page"),
        folder=tmp_path,
    )
    assert told.returncode == 0, told.stderr
    assert f"{len(walk.names)} markers are met within" in told.stdout
    assert (out / "inverse_kinematics.mot").is_file()
    assert json.loads((out / "analysis.json").read_text())["markers"]["file"] == "walk.trc"
    assert {path.name for path in tmp_path.iterdir()} == {"walk.trc", "out"}


def test_what_does_not_say_all_is_refused_in_a_line(walk: Walk, tmp_path: Path) -> None:
    walk.c3d(tmp_path / "mute.c3d", screen=False)
    with pytest.raises(LinkwiseError, match=r"give --c3d-axes \+X,\+Z"):
        walk.followed(tmp_path / "mute.c3d")
    assert walk.followed(tmp_path / "mute.c3d", axes="+X,+Z").total == len(walk.time)
    with pytest.raises(LinkwiseError, match="--plate 2: it has 1 plates"):
        walk.followed(walk.folder / "walk.c3d", "2=foot")
    with pytest.raises(LinkwiseError, match="write it as NUMBER=BODY"):
        walk.followed(walk.folder / "walk.c3d", "foot")
    with pytest.raises(LinkwiseError, match="go with a log of markers"):
        walk.followed(walk.folder / "known.sto", "1=foot")
    with pytest.raises(LinkwiseError, match=r"--plate-threshold and --c3d-axes go with a log of markers"):
        walk.followed(walk.folder / "known.sto", threshold=5.0)
    walk.trc(tmp_path / "short.trc", walk.markers[:2], walk.time[:2])
    with pytest.raises(LinkwiseError, match=r"go with a \.c3d file; .*short\.trc has neither"):
        walk.followed(tmp_path / "short.trc", threshold=5.0)
    with pytest.raises(LinkwiseError, match=r"short\.trc, inverse kinematics of it: 2 samples"):
        walk.followed(tmp_path / "short.trc")
    walk.c3d(tmp_path / "two.c3d", names=["a:heel", "b:heel", *walk.names[2:]])
    with pytest.raises(LinkwiseError, match="several markers have one name, 'a:heel', 'b:heel'"):
        walk.followed(tmp_path / "two.c3d")
    with pytest.raises(LinkwiseError, match=r"give its \.osim file as --robot"):
        analyze(walk.folder / "walk.c3d", kept_package(walk.file))
    (tmp_path / "broken.c3d").write_bytes(b"\x00" * 600)
    with pytest.raises(LinkwiseError, match="ezc3d does not read it"):
        walk.followed(tmp_path / "broken.c3d")
