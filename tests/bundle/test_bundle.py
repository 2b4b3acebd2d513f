"""A bundle is an analysis in one file: run again elsewhere, it gives the same, and what differs is told."""

import csv
import hashlib
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

import numpy as np
import pytest
from helpers.command_line import run_linkwise
from helpers.induced_setup import write_case
from helpers.motion_logs import LEG, PLANAR3, smooth, write_csv
from linkwise import LinkwiseError
from linkwise.analysis.choices import AnalysisChoices
from linkwise.bundle import unpacked
from linkwise.option import chosen
from linkwise.robot import Options
from numpy.typing import NDArray

DATA = LEG.parent
MJCF = """<mujoco model="arm"><compiler meshdir="shapes"/><asset><mesh name="shell" file="shell.obj"/></asset>
<worldbody><body name="upper">{inertial}<joint name="shoulder" axis="0 1 0"/>
<geom type="mesh" mesh="shell"/></body></worldbody></mujoco>"""
SHELL = "\n".join(
    [f"v {x} {y} {z}" for x in (0, 0.1) for y in (0, 0.1) for z in (0, 0.3)]
    + ["f 1 2 4 3", "f 5 7 8 6", "f 1 5 6 2", "f 3 4 8 7", "f 1 3 7 5", "f 2 6 8 4"]
)


def analysed(folder: Path, *words: object) -> Path:
    """Bundle of an analysis in `folder`, which is gone from then on."""
    done = run_linkwise("analyze", *words, "--out", "out", "--no-page", "--bundle", folder=folder)
    assert done.returncode == 0, done.stderr
    assert "out/bundle.zip" in done.stdout
    bundle = folder.with_suffix(".zip")
    shutil.move(folder / "out/bundle.zip", bundle)
    shutil.rmtree(folder)
    return bundle


@pytest.fixture
def case(tmp_path: Path) -> Path:
    folder = tmp_path / "case"
    folder.mkdir()
    write_csv(folder / "log.csv", smooth(60, 3))
    return folder


def replayed(bundle: Path, *words: object) -> str:
    done = run_linkwise("replay", bundle, *words, folder=bundle.parent)
    assert done.returncode == 0, done.stderr
    assert "\nthe same, within 1e-09\n" in done.stdout
    return done.stdout


def changed(bundle: Path, change: Callable[[dict[str, bytes]], None]) -> Path:
    """Bundle with other content, packed anew."""
    with ZipFile(bundle) as archive:
        content = {name: archive.read(name) for name in archive.namelist()}
    change(content)
    path = bundle.with_name("changed.zip")
    with ZipFile(path, "w", ZIP_DEFLATED) as archive:
        for name, data in content.items():
            archive.writestr(name, data)
    return path


def changed_record(bundle: Path, change: Callable[[Any], None]) -> Path:
    """The bundle with another record of its result, whose hash is made to fit."""

    def change_all(content: dict[str, bytes]) -> None:
        told, record = (json.loads(content[name]) for name in ("bundle.json", "result/analysis.json"))
        change(record)
        data = content["result/analysis.json"] = json.dumps(record).encode()
        told["files"]["result/analysis.json"] = {
            "bytes": len(data),
            "sha256": hashlib.sha256(data).hexdigest(),
        }
        content["bundle.json"] = json.dumps(told).encode()

    return changed(bundle, change_all)


def asked_otherwise(bundle: Path, **choices: object) -> Path:
    def change(content: dict[str, bytes]) -> None:
        record = json.loads(content["bundle.json"])
        record["analysis"]["choices"] |= choices
        content["bundle.json"] = json.dumps(record).encode()

    return changed(bundle, change)


def test_a_bundle_is_replayed_where_nothing_else_is(case: Path) -> None:
    (case / "deep").mkdir()
    shutil.copy(LEG, case / "deep/leg.toml")
    joints = ["pelvis_tx", "pelvis_ty", "pelvis_tilt", "hip_flexion_r", "knee_angle_r", "ankle_angle_r"]
    write_csv(case / "log.csv", smooth(60, 6), joints)
    write_csv(case / "push.csv", smooth(60, 3), [f"foot/force_{axis}" for axis in "xyz"])
    (case / "sure.toml").write_text('schema = 1\n[all]\nmass = "5 %"\n')
    words = ["log.csv", "--robot", "deep/leg.toml", "--base", "fixed", "--cutoff", 6, "--padding", "even"]
    words += ["--loads", "push.csv", "--loads-cutoff", 5, "--uncertain", "sure.toml", "--lock"]
    words += ["ankle_angle_r=0.1", "--ignore-extra", "--from", 0.1, "--phase", "first=0..0.3"]
    bundle = analysed(case, *words, "--payload", "foot=2,0.1,0,0")
    told = replayed(bundle, "--out", "again")
    assert "the same here" in told
    assert "compared: 50 samples of" in told
    assert str(Path("again/analysis.parquet")) in told
    assert "bundle.zip" not in told


@pytest.mark.parametrize("table", ["parquet", "csv", "none"])
def test_a_number_that_differs_is_told_with_column_and_sample(case: Path, table: str) -> None:
    bundle = analysed(case, "log.csv", "--robot", "planar3", "--cutoff", 6, "--format", table)
    other = asked_otherwise(bundle, cutoff=6.001)
    done = run_linkwise("replay", other, "--out", "other", folder=case.parent)
    assert done.returncode == 1, done.stderr
    assert "\nNOT the same, within 1e-09\n" in done.stdout
    of_record = re.search(r"compared: (\d+) numbers of the record; largest difference: (\S+), ", done.stdout)
    assert of_record is not None
    assert int(of_record[1]) > 20
    assert 1e-9 < float(of_record[2]) < 1e-2
    found = re.search(r"largest difference: (\S+) \S.* in (\S+), (.*); (\S+) of the largest", done.stdout)
    assert (found is None) == (table == "none")
    assert found is None or 1e-9 < float(found[4]) < 1e-2
    if found is not None and table == "csv":
        with ZipFile(bundle) as archive:
            was = read_table(archive.read("result/analysis.csv").decode())
        now = read_table((case.parent / "other/analysis.csv").read_text())
        apart = np.abs(was[found[2]] - now[found[2]])
        assert (f"sample {apart.argmax()}", f"{apart.max():.3g}") == (found[3], found[1])
    loose = run_linkwise("replay", other, "--tolerance", 0.1, folder=case.parent)
    assert (loose.returncode, "\nthe same, within 0.1\n" in loose.stdout) == (0, True)


def read_table(text: str) -> dict[str, NDArray[np.float64]]:
    names, *rows = csv.reader(text.splitlines())
    return dict(zip(names, np.array(rows, dtype=float).T, strict=True))


def test_columns_in_other_units_are_not_the_same(case: Path) -> None:
    bundle = analysed(case, "log.csv", "--robot", "planar3")

    def in_degrees(record: Any) -> None:
        next(one for one in record["columns"] if one["name"] == "q/joint1")["unit"] = "deg"

    done = run_linkwise("replay", changed_record(bundle, in_degrees), folder=case.parent)
    assert done.returncode == 1
    assert "1 columns in another unit: q/joint1" in done.stdout


def test_columns_that_only_one_result_has_are_not_the_same(case: Path) -> None:
    bundle = analysed(case, "log.csv", "--robot", "planar3", "--columns", "sums")
    done = run_linkwise("replay", asked_otherwise(bundle, columns=["tau/*"]), folder=case.parent)
    assert done.returncode == 1
    assert "columns not here: " in done.stdout
    assert "no number of them differs" in done.stdout
    assert re.search(r"\d+ numbers not here: .*work/of_joints/joint2/net", done.stdout)


@pytest.mark.parametrize(
    ("place", "value"),
    [
        (("work", "of_joints", 1, "given"), 0.5),
        (("cutoff_sweep", "joint_torques", 0, "change"), 0.5),
        (("processing", "lowpass", "cutoff"), 12.0),
        (("closure", "terms_relative"), 0.5),
        (("columns", 5, "peak_magnitude"), 1e6),
    ],
)
def test_numbers_of_the_record_are_compared_beside_a_table(
    case: Path, place: tuple[str | int, ...], value: float
) -> None:
    words = ["log.csv", "--robot", "planar3", "--cutoff", 6, "--cutoff-sweep", "4,6,8"]
    bundle = analysed(case, *words)
    replayed(bundle)

    def change(record: Any) -> None:
        part = record
        for key in place[:-1]:
            part = part[key]
        part[place[-1]] = value

    done = run_linkwise("replay", changed_record(bundle, change), folder=case.parent)
    assert done.returncode == 1, done.stderr
    assert "no number of them differs" in done.stdout
    worst = rf"numbers of the record; largest difference: \S+, {place[0]}/\S*{place[-1]}: \S+ before"
    assert re.search(worst, done.stdout), done.stdout


def test_another_number_of_samples_is_told(case: Path) -> None:
    bundle = analysed(case, "log.csv", "--robot", "planar3")
    done = run_linkwise("replay", asked_otherwise(bundle, from_time=0.2), folder=case.parent)
    assert done.returncode == 2
    assert "the bundle's result has 60 samples, and this one 40" in done.stderr


def test_an_opensim_setup_with_its_loads_goes_along(case: Path) -> None:
    write_case(case, "", "plate.xml", "body1 CENTER_OF_MASS")
    bundle = analysed(case, "--opensim-setup", "setup.xml")
    with ZipFile(bundle) as archive:
        assert {name for name in archive.namelist() if name.startswith("files/")} == {
            "files/0/plate.xml",
            "files/0/plate.sto",
        }
    replayed(bundle)


def test_loads_named_by_a_path_of_this_machine_are_refused(case: Path) -> None:
    write_case(case, "", "plate.xml", "body1 CENTER_OF_MASS")
    plate = case / "plate.xml"
    plate.write_text(plate.read_text().replace("plate.sto", str(case / "plate.sto")))
    done = run_linkwise("analyze", "--opensim-setup", "setup.xml", "--out", "out", "--bundle", folder=case)
    assert done.returncode == 2
    assert "by paths of this machine; name them relative to it" in done.stderr
    assert not (case / "out").exists()


@pytest.mark.parametrize("has_inertia", [True, False])
def test_meshes_are_left_out_unless_the_robot_cannot_be_read_without(case: Path, has_inertia: bool) -> None:
    inertial = '<inertial pos="0 0 0.1" mass="1" diaginertia="1 1 1"/>' if has_inertia else ""
    (case / "shapes").mkdir()
    (case / "shapes/shell.obj").write_text(SHELL)
    (case / "arm.xml").write_text(MJCF.format(inertial=inertial))
    write_csv(case / "log.csv", smooth(60, 1), ["shoulder"])
    bundle = analysed(case, "log.csv", "--robot", "arm.xml")
    with ZipFile(bundle) as archive:
        assert ("robot/shapes/shell.obj" in archive.namelist()) is not has_inertia
    assert ("left out of it: shell.obj" in replayed(bundle)) is has_inertia


def test_a_robot_whose_files_are_named_by_paths_of_this_machine_is_refused(case: Path) -> None:
    (case / "arm.xml").write_text(f'<mujoco><include file="{case}/inner.xml"/></mujoco>')
    (case / "inner.xml").write_text(
        '<mujoco><worldbody><body><joint name="shoulder"/><geom size="0.1"/></body></worldbody></mujoco>'
    )
    write_csv(case / "log.csv", smooth(60, 1), ["shoulder"])
    words = ["log.csv", "--robot", "arm.xml", "--out", "out"]
    assert run_linkwise("analyze", *words, "--no-page", folder=case).returncode == 0
    done = run_linkwise("analyze", *words, "--bundle", folder=case)
    assert (done.returncode, "arm.xml names files by paths of this machine" in done.stderr) == (2, True)


@pytest.mark.parametrize("kind", ["package", "program"])
def test_code_is_not_run_unless_it_is_trusted(case: Path, kind: str) -> None:
    if kind == "package":
        shutil.copytree(PLANAR3, case / "arm")
        bundle = analysed(case, "log.csv", "--robot", "arm")
    else:
        shutil.copy(DATA / "cart_pendulum.py", case)
        write_csv(case / "log.csv", smooth(60, 2), ["x", "theta"])
        bundle = analysed(case, "log.csv", "--robot", "cart_pendulum.py")
    done = run_linkwise("replay", bundle, folder=case.parent)
    assert done.returncode == 2
    assert "which replay does not run by itself; read it, and give --trust-python" in done.stderr
    replayed(bundle, "--trust-python")


def _damage(content: dict[str, bytes]) -> None:
    content["log/log.csv"] += b"\n"


def _named(name: str) -> Callable[[dict[str, bytes]], None]:
    def change(content: dict[str, bytes]) -> None:
        record = json.loads(content["bundle.json"])
        record["files"][name] = record["files"]["log/log.csv"]
        content |= {"bundle.json": json.dumps(record).encode(), name: content["log/log.csv"]}

    return change


def _wrong(*keys: str, value: object) -> Callable[[dict[str, bytes]], None]:
    def change(content: dict[str, bytes]) -> None:
        record = at = json.loads(content["bundle.json"])
        for key in keys[:-1]:
            at = at[key]
        at[keys[-1]] = value
        content["bundle.json"] = json.dumps(record).encode()

    return change


def _empty(content: dict[str, bytes]) -> None:
    del content["bundle.json"]


def _large(content: dict[str, bytes]) -> None:
    content["bundle.json"] += b" " * (1 << 24)


def _with(name: str, data: bytes, **asked: object) -> Callable[[dict[str, bytes]], None]:
    """A change that puts a file there, with its hash, and says other things of the analysis."""

    def change(content: dict[str, bytes]) -> None:
        record = json.loads(content["bundle.json"])
        record["files"][name] = {"bytes": len(data), "sha256": hashlib.sha256(data).hexdigest()}
        record["analysis"] |= asked
        content |= {"bundle.json": json.dumps(record).encode(), name: data}

    return change


def _without_table(content: dict[str, bytes]) -> None:
    record = json.loads(content["bundle.json"])
    del record["files"]["result/analysis.parquet"], content["result/analysis.parquet"]
    content["bundle.json"] = json.dumps(record).encode()


PROGRAM = b"from pathlib import Path\nPath('RAN').touch()\n"


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (_damage, "its file 'log/log.csv' is not what was packed"),
        (_named("../evil.csv"), "has a file '../evil.csv', outside of its folders"),
        (_named("/evil.csv"), "has a file '/evil.csv', outside of its folders"),
        (_named("log\\evil.csv"), "has a file 'log\\\\evil.csv', outside of its folders"),
        (_named("C:evil.csv"), "has a file 'C:evil.csv', outside of its folders"),
        (_named("planar3"), "has a file 'planar3', outside of its folders"),
        (_named("log/../../evil.csv"), "outside of its folders"),
        (_empty, "is no bundle, or a damaged one: There is no item named"),
        (_large, "its bundle.json is larger than 16 MiB"),
        (_wrong("schema", value=7), "is no bundle, or a damaged one: schema is not 1"),
        (_wrong("analysis", "backend", value=3), "analysis.backend is not a string"),
        (_wrong("analysis", "kind", value="x"), "analysis.kind is not 'built-in' or 'file'"),
        (_wrong("analysis", "choices", value=[]), "analysis.choices is not an object"),
        (_wrong("analysis", "choices", value={"cutof": 7.0}), "has the unknown key 'cutof'; known are"),
        (_wrong("analysis", "choices", value={"cutoff": "four"}), "cutoff is 'four'; give a number"),
        (_wrong("analysis", "choices", value={"cutoff": True}), "cutoff is True; give a number"),
        (_wrong("files", "log/log.csv", value=None), "files.log/log.csv is not an object"),
        (_wrong("files", "log/log.csv", "bytes", value=10**15), "MiB unpacked, and"),
        (_wrong("files", "log/log.csv", "bytes", value=10**30), "is not a whole number"),
        (_wrong("analysis", "log", value="/log.csv"), "names '/log.csv', which is not in it; do not trust"),
        (_wrong("analysis", "robot", value="../a.urdf"), "its robot '../a.urdf' is not built in"),
        (_wrong("analysis", "choices", value={"loads": ["/p.csv"]}), "names '/p.csv', which is not in it"),
        (_wrong("analysis", "options", value={"constraints": "/c.toml"}), "names '/c.toml', which is not"),
        (_with("robot/a.py", PROGRAM, robot="robot/a.py"), "its robot 'robot/a.py' is not built in"),
        (_with("robot/a.py", PROGRAM, robot="robot/a.py", kind="file"), "robot is a file, which is not so"),
        (_with("robot/a.py", PROGRAM, robot="robot/a.py", kind="program"), "give --trust-python"),
        (_with("result/analysis.json", b"{}"), "its result is damaged: 'columns'"),
        (_with("result/analysis.parquet", b"PAR1 and no more"), "its result is damaged: "),
        (_without_table, "its result lacks analysis.parquet"),
    ],
)
def test_a_changed_bundle_is_refused(
    case: Path, change: Callable[[dict[str, bytes]], None], told: str
) -> None:
    bundle = analysed(case, "log.csv", "--robot", "planar3")
    done = run_linkwise("replay", changed(bundle, change), folder=case.parent)
    assert (done.returncode, told in done.stderr, done.stderr.count("\n")) == (2, True, 1), done.stderr
    assert not list(case.parent.rglob("RAN"))
    assert not list(case.parent.rglob("evil.csv"))


def test_loads_in_a_bundle_that_name_files_outside_are_refused(case: Path) -> None:
    write_case(case, "", "plate.xml", "body1 CENTER_OF_MASS")
    outside = shutil.copy(case / "plate.sto", case.parent)
    text = (case / "plate.xml").read_text().replace("plate.sto", str(outside))
    bundle = analysed(case, "--opensim-setup", "setup.xml")
    other = changed(bundle, _with("files/0/plate.xml", text.encode()))
    done = run_linkwise("replay", other, folder=case.parent)
    assert (done.returncode, "its files/0/plate.xml names files that are not in it" in done.stderr) == (
        2,
        True,
    )


def test_a_robot_in_a_bundle_that_names_files_outside_is_refused(case: Path) -> None:
    body = '<mujoco><worldbody><body><joint name="shoulder"/><geom size="0.1"/></body></worldbody></mujoco>'
    (case / "arm.xml").write_text(body)
    (case.parent / "inner.xml").write_text(body)
    write_csv(case / "log.csv", smooth(60, 1), ["shoulder"])
    bundle = analysed(case, "log.csv", "--robot", "arm.xml")
    text = f'<mujoco><include file="{case.parent}/inner.xml"/></mujoco>'
    done = run_linkwise("replay", changed(bundle, _with("robot/arm.xml", text.encode())), folder=case.parent)
    assert (done.returncode, "its robot/arm.xml names files that are not in it" in done.stderr) == (2, True)


def test_a_result_in_the_place_of_the_bundle_is_refused(case: Path) -> None:
    words = ["log.csv", "--robot", "planar3", "--out", "out", "--no-page", "--bundle"]
    assert run_linkwise("analyze", *words, folder=case).returncode == 0
    done = run_linkwise("replay", "out/bundle.zip", "--out", "out", folder=case)
    assert (done.returncode, "holds the bundle; give another --out" in done.stderr) == (2, True)
    assert (case / "out/bundle.zip").is_file()
    for words in (["--tolerance", "inf"], ["--tolerance", "nan"]):
        assert run_linkwise("replay", "out/bundle.zip", *words, folder=case).returncode == 2


def test_what_is_no_bundle_is_refused(tmp_path: Path) -> None:
    (tmp_path / "log.csv").write_text("time,a\n")
    for name, told in (
        ("log.csv", "is no bundle, or a damaged one: File is not a zip file"),
        ("gone.zip", "gone.zip: no such file"),
        (".", "this is a directory; give a bundle that `linkwise analyze --bundle` wrote"),
    ):
        done = run_linkwise("replay", name, folder=tmp_path)
        assert (done.returncode, done.stderr.count("\n"), told in done.stderr) == (2, 1, True), done.stderr


def test_what_has_no_room_is_refused_before_it_is_unpacked(
    case: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bundle = analysed(case, "log.csv", "--robot", "planar3")
    monkeypatch.setattr(shutil, "disk_usage", lambda folder: SimpleNamespace(free=2**12))
    with pytest.raises(LinkwiseError, match=r"MiB unpacked, and .* has 0 MiB left"):
        unpacked(bundle, tmp_path / "there")
    assert not list((tmp_path / "there").iterdir())


def test_written_options_come_back_as_they_were(case: Path) -> None:
    words = ["log.csv", "--robot", "planar3", "--map", "joint1=joint1", "--induced", "joints"]
    bundle = analysed(case, *words, "--trace", "joint1", "--trace-windows", 0.2, "--lock", "joint3=0.1")
    asked = unpacked(bundle, case.parent / "there").analysis
    assert asked.log == "log/log.csv"
    choices, options = chosen(AnalysisChoices, asked.choices), chosen(Options, asked.options)
    assert choices.reading.pairs == (("joint1", "joint1"),)
    assert (choices.outputs.induced, choices.outputs.trace.windows) == (("joints",), 0.2)
    assert options.lock == {"joint3": 0.1}
