"""A robot's file in place of a package: one is generated, kept, and made again when the file changes."""

import json
import math
import os
import shutil
from pathlib import Path

import pytest
from conftest import DATA
from helpers.command_line import run_linkwise
from helpers.motion_logs import smooth, write_csv
from helpers.osim_text import ROLLING, chain
from linkwise import (
    LinkwiseError,
    Options,
    analyze,
    check_package,
    generate,
    generator_fingerprint,
    kept_package,
    read_robot,
    read_system,
)
from linkwise.own_process import ProcessLimits, in_own_process
from linkwise.package.manifest import FILE

KNEE = DATA / "knee.osim"


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("LINKWISE_CACHE", str(tmp_path / "cache"))
    return tmp_path / "cache"


def walk(folder: Path) -> Path:
    rows = "\n".join(f"{k / 50},{k % 3},{-k % 2},{k / 8},{k / 9},{-k / 8}" for k in range(20))
    joints = "hip_adduction,hip_rotation,hip_flexion,knee_angle,ankle_angle"
    (folder / "walk.csv").write_text(f"time,{joints}\n{rows}\n", encoding="utf-8")
    return folder / "walk.csv"


def test_an_analysis_is_the_same_by_file_and_by_package(tmp_path: Path) -> None:
    log = walk(tmp_path)
    asked = ("--no-page", "--backend", "numpy", "--units", "deg")
    made = run_linkwise("generate", KNEE, "--out", "out", "--backend", "numpy", folder=tmp_path)
    assert made.returncode == 0
    for robot, out in ((KNEE, "by_file"), ("out/knee", "by_package")):
        done = run_linkwise("analyze", log, "--robot", robot, "--out", out, *asked, folder=tmp_path)
        assert done.returncode == 0, done.stderr
    tables = [(tmp_path / out / "analysis.parquet").read_bytes() for out in ("by_file", "by_package")]
    assert len(tables[0]) == len(tables[1])


def test_a_package_tells_how_it_was_asked_for_whoever_makes_it(tmp_path: Path) -> None:
    (tmp_path / "odd.toml").write_text(
        'schema = 1\nname = "odd"\nlink = [{ name = "a", mass = -1, com = [0.1, 0, 0], '
        "inertia = { xx = 1, yy = 1, zz = 1 } }]\n"
        'joint = [{ name = "a joint", parent = "base", child = "a", axis = [0, 1, 0] }]\n'
    )
    options = Options("symbolic", allow_unphysical=True)
    flags = ("--allow-unphysical", "--parameters", "symbolic", "--backend", "numpy")
    done = run_linkwise("generate", "odd.toml", "--out", "out", *flags, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    kept = kept_package(tmp_path / "odd.toml", "numpy", options).directory
    folders = [
        {
            path.relative_to(folder).as_posix(): path.read_text(encoding="utf-8")
            for path in folder.rglob("*.*")
        }
        for folder in (tmp_path / "out/odd", kept)
    ]
    read = [read(tmp_path / "odd.toml", options) for read in (read_system, read_robot)]
    assert all(
        files == folders[0]
        for files in (
            folders[1],
            *(generate(*asked) for asked in zip(read, ("numpy", ["numpy"]), strict=True)),
        )
    )
    request = json.loads(folders[0][FILE])["request"]
    assert request == {"robot": "odd.toml", **options.request()} | {
        "backends": ["numpy"],
        "kernel": "auto",
        "derivation": "rule",
        "vendor_runtime": False,
    }
    assert not [result for result in check_package(kept, 5) if result.mark == "FAIL"]


def test_a_back_end_that_writes_nothing_keeps_no_package(cache: Path) -> None:
    with pytest.raises(LinkwiseError, match="follows a curve, and no closed forms are derived for that"):
        kept_package(KNEE, "formulas")
    with pytest.raises(LinkwiseError, match="no back end 'foo'; choose among numpy"):
        kept_package(KNEE, "foo")
    assert not list(cache.glob("packages/*/*"))


def test_it_is_made_once_and_again_when_the_file_changes(tmp_path: Path) -> None:
    file = tmp_path / "leg.osim"
    shutil.copyfile(KNEE, file)
    first = kept_package(file, "numpy").directory
    made = (first / FILE).stat().st_mtime_ns
    assert kept_package(file, "numpy").directory == first
    assert (first / FILE).stat().st_mtime_ns == made
    file.write_text(file.read_text().replace("<mass>8.4</mass>", "<mass>8.5</mass>"))
    second = kept_package(file, "numpy").directory
    assert second != first
    masses = [json.loads((at / FILE).read_text())["tree"]["links"][0]["mass"] for at in (first, second)]
    assert masses == [8.4, 8.5]


ROD = """<mujoco><include file="part.xml"/></mujoco>"""
PART = """<mujoco><worldbody><body name="rod"><joint name="hinge" axis="0 1 0"/>
<inertial pos="0.1 0 0" mass="{}" diaginertia="0.1 0.1 0.1"/></body></worldbody></mujoco>"""


def test_it_is_made_again_when_anything_changes_that_it_is_made_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A file that is included, one of constraints beside, linkwise itself; and for other back ends."""
    pytest.importorskip("mujoco")
    (tmp_path / "rod.xml").write_text(ROD)
    masses = []
    for mass in (1.0, 2.0):
        (tmp_path / "part.xml").write_text(PART.format(mass))
        kept = kept_package(tmp_path / "rod.xml", "numpy").directory
        masses.append(json.loads((kept / FILE).read_text())["tree"]["links"][0]["mass"])
    assert masses == [1.0, 2.0]
    ties, lengths = tmp_path / "ties.toml", []
    (tmp_path / "bar.toml").write_text((DATA / "fourbar.toml").read_text().partition("[[constraint]]")[0])
    for reach in (0.31, 0.3):
        ties.write_text(
            'schema = 1\n[[constraint]]\nname = "pin"\ntype = "point"\n'
            f'first = {{ frame = "rod", xyz = [{reach}, 0, 0] }}\n'
            'second = { frame = "rocker", xyz = [0.24, 0, 0] }\n'
        )
        kept = kept_package(tmp_path / "bar.toml", "numpy", Options(constraints=str(ties))).directory
        (first,) = (
            f for f in json.loads((kept / FILE).read_text())["tree"]["frames"] if f["name"] == "pin_first"
        )
        lengths.append(first["translation"][0])
    assert lengths == [0.31, 0.3]
    here = kept_package(KNEE, "numpy").directory
    assert kept_package(KNEE, "c").directory != here
    monkeypatch.setattr("linkwise.package_cache.generator_files", lambda: [str(ties)])
    elsewhere = kept_package(KNEE, "numpy").directory
    ties.write_text("changed")
    assert len({here, elsewhere, kept_package(KNEE, "numpy").directory}) == 3


def test_what_a_file_leaves_out_is_told_each_time(tmp_path: Path) -> None:
    file = tmp_path / "leg.osim"
    forces = '<ForceSet><objects><BushingForce name="disc"/></objects></ForceSet></Model>'
    file.write_text(KNEE.read_text().replace("</Model>", forces))
    for _ in range(2):
        (warning,) = kept_package(file, "numpy").warnings
        assert warning == f"{file}: bushing left out of the torques: disc"
    names = [coordinate.name for coordinate in read_system(file).coordinates]
    write_csv(tmp_path / "log.csv", smooth(20, len(names)), names)
    flags = ("--robot", "leg.osim", "--out", "out", "--no-page")
    done = run_linkwise("analyze", "log.csv", *flags, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "warning: leg.osim: bushing left out of the torques: disc\n" in done.stderr


def test_a_package_is_itself_and_what_is_neither_is_refused_in_a_line(tmp_path: Path) -> None:
    assert kept_package(tmp_path).directory == tmp_path
    with pytest.raises(LinkwiseError, match=r"^gone.osim: no such file"):
        kept_package("gone.osim")
    for robot, message in (
        ("gone.osim", "gone.osim: no such file"),
        ("gone", "gone: no generated robot there"),
    ):
        done = run_linkwise("analyze", walk(tmp_path), "--robot", robot, "--out", "out", folder=tmp_path)
        assert (done.returncode, done.stdout) == (2, "")
        assert done.stderr.startswith(f"linkwise: error: {message}")
        assert len(done.stderr.splitlines()) == 1
        assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("blocked", ["cache", "cache/packages"])
def test_a_cache_that_cannot_be_written_is_told_with_the_mend(blocked: str, cache: Path) -> None:
    (cache.parent / blocked).parent.mkdir(mode=0o700, exist_ok=True)
    (cache.parent / blocked).touch()
    mend = r"knee\.osim: no package of it can be kept: .*; set LINKWISE_CACHE to another directory$"
    with pytest.raises(LinkwiseError, match=mend):
        kept_package(KNEE)


def test_a_file_that_is_no_robots_is_refused_before_it_is_read_to_its_end(tmp_path: Path) -> None:
    path = tmp_path / "arm.urdf"
    path.touch()
    os.truncate(path, 1 << 34)
    with pytest.raises(LinkwiseError) as caught:
        in_own_process(lambda: kept_package(path), ProcessLimits(seconds=30, memory=256 << 20))
    assert str(caught.value).startswith(
        f"{path}: the file is larger than 4 MiB, which no robot's description"
    )


def test_options_of_reading_make_another_package_and_are_refused_for_one_that_is_there(
    tmp_path: Path,
) -> None:
    held = kept_package(KNEE, "numpy", Options(lock={"knee_angle": 0.3})).directory
    assert held != kept_package(KNEE, "numpy").directory
    asked = ("analyze", walk(tmp_path), "--out", "out", "--lock", "ankle_angle=0")
    done = run_linkwise(*asked, "--robot", held, folder=tmp_path)
    assert (done.returncode, done.stdout) == (2, "")
    assert "leave --lock out, or generate it anew with them, or name the robot's own file" in done.stderr
    done = run_linkwise(*asked, "--robot", KNEE, folder=tmp_path)
    assert (done.returncode, done.stderr.splitlines()[-1]) == (0, "left out: ankle_angle")


def test_what_opensim_keeps_in_radians_stays_so_in_a_log_in_degrees(tmp_path: Path) -> None:
    """The coordinate turns no axis one to one; columns of a locked one are left out unasked."""
    locked = {"joint2_angle": "<default_value>0.4</default_value><locked>true</locked>"}
    (tmp_path / "model.osim").write_text(chain([ROLLING, "PinJoint", "PinJoint"], coordinates=locked))
    columns = "joint0_turn", "joint0_slip", "joint1_angle", "joint2_angle"
    rows = "\n".join(f"{k / 50} 0.5 0.1 90 20" for k in range(20))
    head = f"walk\nversion=1\nnRows=20\nnColumns=5\ninDegrees=yes\nendheader\ntime {' '.join(columns)}"
    (tmp_path / "walk.mot").write_text(f"{head}\n{rows}\n")
    found = analyze(tmp_path / "walk.mot", kept_package(tmp_path / "model.osim", "numpy").directory)
    assert found.ignored == ("joint2_angle",)
    assert found.q[0] == pytest.approx([0.5, 0.1, math.pi / 2], rel=1e-15)


def test_columns_of_joints_that_the_file_couples_are_left_out_unasked(tmp_path: Path) -> None:
    log, paths = walk(tmp_path), ("patella_slide", "/jointset/groove/patella_slide/value")
    head, *rows = log.read_text().splitlines()
    log.write_text("\n".join([",".join((head, *paths)), *(f"{row},0.1,0.1" for row in rows)]))
    found = analyze(log, kept_package(KNEE, "numpy").directory)
    assert found.ignored == paths
    log.write_text("\n".join([f"{head},arm", *(f"{row},0.1" for row in rows)]))
    with pytest.raises(LinkwiseError, match="no joint for column 'arm'"):
        analyze(log, kept_package(KNEE, "numpy").directory)


def test_the_order_in_which_a_disk_lists_files_changes_no_fingerprint(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rglob, of_now = Path.rglob, generator_fingerprint.fingerprint.__wrapped__
    monkeypatch.setattr(generator_fingerprint, "_own_files", generator_fingerprint._own_files.__wrapped__)
    usual = of_now()
    monkeypatch.setattr(Path, "rglob", lambda self, pattern: reversed(list(rglob(self, pattern))))
    assert of_now() == usual
