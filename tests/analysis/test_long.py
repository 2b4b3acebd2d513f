"""Logs too long to be drawn whole: every number is of all samples, and what is drawn loses no peak."""

import base64
import gzip
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from helpers.command_line import run_linkwise
from helpers.motion_logs import LEG, smooth, write_csv
from linkwise import generate, read_system, write_package
from linkwise.analysis import Analysis, Contact, Contacts, Reading, WhileColumn, analyze
from linkwise.analysis.disk_rows import EverySample
from linkwise.analysis.show import figure_bytes
from linkwise.analysis.show.drawn_curves import PIECES
from linkwise.analysis.show.page_curves import stride_for

JOINTS = ("pelvis_tx", "pelvis_ty", "pelvis_tilt", "hip_flexion_r", "knee_angle_r", "ankle_angle_r")
SAMPLES, RATE = 4003, 500.0
PHASE = "stance/swing=stands>0.5"
FIGURES = ("paper:knee_angle_r", "causes:knee_angle_r", "shares", "power", "induced", "contacts")


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A leg, a log that swings from sample to sample, of which every second one would tell another story."""
    made: Path = tmp_path_factory.mktemp("long")
    write_package(generate(read_system(LEG), ["numpy"]), made / "leg")
    log = smooth(SAMPLES, 6, RATE)
    log[:, 1:] *= 0.4
    log[:, 4:] += 2e-6 * (-1.0) ** np.arange(SAMPLES)[:, None] * (1.0 + np.sin(log[:, :1]))
    log[1501, 5] += 1e-4
    stands = (log[:, 0] % 0.9 < 0.2).astype(float)
    write_csv(made / "log.csv", np.column_stack([log, stands]), [*JOINTS, "stands"])
    figures = [word for name in FIGURES for word in ("--figure", name)]
    contact = ["--contact", "sole:foot=held@0.1,-0.06,0", "--contact-while", "sole=stands>0.5"]
    asked = [*contact, "--phase", PHASE, "--induced", "centre-of-mass", *figures]
    done = run_linkwise("analyze", "log.csv", "--robot", "leg", "--out", "out", *asked, folder=made)
    assert done.returncode == 0, done.stderr
    return made


@pytest.fixture(scope="module")
def analysis(place: Path) -> Analysis:
    """Return the same analysis in Python."""
    held = Contacts(
        (Contact("foot", "held", (0.1, -0.06, 0.0), name="sole"),), {"sole": WhileColumn("stands")}
    )
    asked: dict[str, Any] = {"contacts": held, "induced": ["centre-of-mass"], "phases": [PHASE]}
    return analyze(place / "log.csv", place / "leg", Reading(ignore_extra=True), **asked)


@pytest.fixture(scope="module")
def table(place: Path) -> dict[str, Any]:
    """The columns that the command wrote."""
    found = pq.read_table(place / "out" / "analysis.parquet")
    return {name: found[name].to_numpy() for name in found.column_names}


@pytest.mark.parametrize("name", FIGURES)
def test_the_commands_figure_is_pythons(place: Path, analysis: Analysis, name: str) -> None:
    file = place / "out" / f"{name.replace(':', '-')}.png"
    assert file.read_bytes() == figure_bytes(analysis, name)


def test_numbers_of_causes_are_of_all_samples(analysis: Analysis, table: dict[str, Any]) -> None:
    curves = {
        "all causes together": table["tau/knee_angle_r"],
        "gravity": _sum(table, "tau_gravity/knee_angle_r/"),
        **{f"{joint} motion": _sum(table, "tau_q(d|dd)/knee_angle_r/[^/]+/", joint) for joint in JOINTS},
    }
    means, sizes = analysis.figure("causes:knee_angle_r").axes[1:]
    words = dict(zip(analysis.robot.figure_joints, analysis.robot.joints, strict=True))
    told = [text.get_text() for text in means.get_yticklabels()]
    rows = [
        f"{words[row.removesuffix(' motion')]} motion" if row.endswith(" motion") else row for row in told
    ]
    stands = table["time"] % 0.9 < 0.2
    for phase, (label, mask) in enumerate((("stance", stands), ("swing", ~stands))):
        assert means.containers[phase].get_label() == label
        found = [[bar.get_width() for bar in panel.containers[phase]] for panel in (means, sizes)]
        picked = np.array([curves[row][mask] for row in rows])
        np.testing.assert_allclose(found[0], picked.mean(axis=1), rtol=1e-9, atol=1e-12)
        np.testing.assert_allclose(found[1], np.abs(picked).mean(axis=1), rtol=1e-9)
    whole = [np.abs(curves[row]).mean() for row in rows[1:]]
    assert whole == sorted(whole, reverse=True)


@pytest.mark.parametrize(("name", "panel"), [("causes:knee_angle_r", 0), ("paper:knee_angle_r", 1)])
def test_a_drawn_curve_touches_the_least_and_the_greatest_of_each_piece(
    analysis: Analysis, table: dict[str, Any], name: str, panel: int
) -> None:
    figure = analysis.figure(name)
    torque = table["tau/knee_angle_r"]
    size = -(-SAMPLES // PIECES)
    cuts = np.arange(0, SAMPLES, size)
    line = figure.axes[panel].lines[0 if panel == 0 else JOINTS.index("knee_angle_r")]
    time, values = line.get_xdata(), line.get_ydata()
    assert len(time) <= 2 * PIECES < SAMPLES
    assert (np.diff(time) >= 0).all()
    np.testing.assert_array_equal(values, torque[np.searchsorted(table["time"], time)])
    pairs = np.sort(values.reshape(-1, 2), axis=1)
    np.testing.assert_array_equal(pairs[:, 0], np.minimum.reduceat(torque, cuts))
    np.testing.assert_array_equal(pairs[:, 1], np.maximum.reduceat(torque, cuts))
    said = " ".join(figure.get_supxlabel().split())
    assert f"the least and greatest of every {size} samples, numbers are of all" in said


def test_numbers_of_the_page_are_of_all_samples(place: Path, table: dict[str, Any]) -> None:
    data = _page(place)
    assert (data["samples"], data["total"], data["stride"]) == (1335, SAMPLES, 3)
    curves = data["curves"]
    assert len(curves["keys"]) > 200
    points = np.frombuffer(base64.b64decode(curves["points"]["values"]), "<f4").reshape(
        len(curves["keys"]), -1
    )
    cuts = np.arange(0, SAMPLES, curves["piece"])
    for at, key in enumerate(curves["keys"]):
        whole = _of_key(table, *key.split(" "))
        assert curves["mean"][at] == pytest.approx(np.abs(whole).mean(), rel=1e-9, abs=1e-15)
        assert curves["peak"][at] == pytest.approx(np.abs(whole).max(), rel=1e-9, abs=1e-15)
        pairs = np.sort(points[at].reshape(-1, 2), axis=1)
        room = 1e-6 * np.abs(whole).max() + 1e-15
        np.testing.assert_allclose(pairs[:, 0], np.minimum.reduceat(whole, cuts), atol=room)
        np.testing.assert_allclose(pairs[:, 1], np.maximum.reduceat(whole, cuts), atol=room)
    powers = [values for name, values in table.items() if re.match("power_(link|contact)/", name)]
    assert data["largestPower"] == pytest.approx(np.abs(powers).max())
    forces = [table[f"force/sole force_{axis}"] for axis in "xy"]
    assert data["largestForce"] == pytest.approx(np.linalg.norm(forces, axis=0).max())


def _page(place: Path) -> Any:
    html = (place / "out" / "report.html").read_text(encoding="utf-8")
    found = re.search(r'<script type="application/gzip" id="data">(.*?)</script>', html, re.S)
    assert found is not None
    return json.loads(gzip.decompress(base64.b64decode(found[1])))


def _of_key(table: dict[str, Any], kind: str, i: str, k: str, j: str) -> Any:
    """The curve that a key of the page names, added up from the table's columns."""
    joint, link = JOINTS[int(i)], "[^/]+" if j == "null" else ("pelvis", "thigh", "shank", "foot")[int(j)]
    if kind == "whole":
        return table[f"tau/{joint}" if j == "null" else f"tau/{joint}/{link}"]
    if kind == "tau_gravity":
        return _sum(table, f"tau_gravity/{joint}/{link}")
    quantity = "tau_q(d|dd)" if kind == "motion" else kind
    return _sum(table, f"{quantity}/{joint}/{link}/{JOINTS[int(k)]}")


def _sum(table: dict[str, Any], *pattern: str) -> Any:
    fits = re.compile("".join(pattern) + ("" if pattern[-1][-1] != "/" else "[^/]+"))
    return sum((values for name, values in table.items() if fits.fullmatch(name)), np.zeros(SAMPLES))


@pytest.mark.parametrize("is_on_disk", [True, False])
def test_every_sample_is_kept(tmp_path: Path, is_on_disk: bool) -> None:
    values = np.arange(2000.0).reshape(2, 1000)
    with EverySample(2, 1000, tmp_path if is_on_disk else None) as kept:
        for start in range(0, 1000, 13):
            kept(values[:, start : start + 13])
        found = kept.values
    np.testing.assert_array_equal(found, values)
    assert list(tmp_path.iterdir()) == []


def test_a_page_has_as_many_instants_as_it_can_hold() -> None:
    assert stride_for(1000, 10, 500_000, 1500) == 1
    assert stride_for(1501, 10, 500_000, 1500) == 2
    assert stride_for(10_000, 1000, 500_000, 1500) == 20
