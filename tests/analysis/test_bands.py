"""Deviations in figures and on the page: bands, whiskers, hatches, and the words beside them."""

import base64
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.motion_logs import PLANAR3, smooth, write_csv
from linkwise.analysis import Analysis, analyze
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.result_quantities import QUANTITIES
from linkwise.analysis.result_rows import ResultRows
from linkwise.analysis.show.bands import FAINT
from linkwise.analysis.show.page import page_data
from linkwise.analysis.show.page_certainty import assumptions
from linkwise.analysis.whole_movement import Totals
from linkwise_runtime.certainty.uncertain_bodies import UncertainBodies

FILE = 'schema = 1\n[all]\nmass = "10 %"\ncentre = "30 mm"\nradii = "20 %"\n'
SAME = UncertainBodies(np.full(3, 0.1), np.full((3, 3), 0.03), np.full(3, 0.2))
JOINTS = ("joint1", "joint2", "joint3")


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Analysis:
    """A movement of the planar arm whose bodies are uncertain; reactions and accelerations are certain."""
    folder = tmp_path_factory.mktemp("bands")
    (folder / "bodies.toml").write_text(FILE)
    log = write_csv(folder / "log.csv", smooth(60, 3))
    asked = {"reactions": ["joint2"], "induced": ["joints"], "induced_power": True, "trace": ["joint1"]}
    return analyze(log, PLANAR3, uncertain=folder / "bodies.toml", columns=["all", "tau_by/**"], **asked)


def told_for(result: Analysis, names: tuple[str, ...], patch: pytest.MonkeyPatch) -> Analysis:
    """Return the result with a deviation beside each column of these quantities, a tenth of its largest."""
    rows, places, values = result.rows, list(result.rows.places), [result.values]
    for name in names:
        patch.setitem(QUANTITIES, f"sd/{name}", replace(QUANTITIES[name], name=f"sd/{name}"))
        places += [(f"sd/{name}", at) for other, at in rows.places if other == name]
        largest = np.abs(result.values[rows[name].numbers]).max(axis=1, keepdims=True)
        values.append(np.broadcast_to(0.1 * largest, (len(largest), len(result.time))))
    every = np.concatenate(values)
    totals = Totals(np.abs(every).mean(axis=1), np.abs(every).max(axis=1), np.sqrt((every**2).mean(axis=1)))
    return replace(
        result, rows=ResultRows(rows.axes, rows.points, tuple(places)), values=every, totals=totals
    )


def halves(panel: Any) -> list[Any]:
    """Return half the heights of a panel's bands at all samples, in the order of drawing."""
    bands = [patch for patch in panel.patches if patch.get_alpha() == FAINT]
    edges = [band.get_xy()[:-1, 1].reshape(2, -1) for band in bands]
    return [(high[::-1] - low) / 2 for low, high in edges]


def exact(result: Analysis) -> Any:
    return load_robot(PLANAR3).model.uncertainty(result.q, result.qd, result.qdd, bodies=SAME)


def test_whiskers_of_shares_are_mean_deviations_and_never_below_those_of_sums(result: Analysis) -> None:
    pytest.importorskip("matplotlib")
    figure = result.figure("shares")
    whiskers = [one for one in figure.axes[0].containers if hasattr(one, "has_xerr")]
    sums, sizes = exact(result), []
    apart = np.asarray(sums.joint_acceleration), np.asarray(sums.joint_velocity)
    for spread in (np.asarray(sums.joint_gravity)[..., None], apart[0] + apart[1]):
        sizes += list(np.moveaxis(spread.mean(axis=0), -1, 0))
    true = np.array([sizes[0], *(result.dense("sd/tau_by")[:, :, 1 + k].mean(axis=0) for k in range(3))])
    terms = [result.gravity.sum(2)[..., None], (result.acceleration + result.velocity).sum(2)]
    means = np.moveaxis(np.abs(np.concatenate(terms, -1)).mean(axis=0), -1, 0)
    share = 100 / means.sum(axis=0)
    drawn = np.zeros((4, 3))
    for part, one in enumerate(whiskers):
        for (left, at), (right, _) in one.lines[2][0].get_segments():
            drawn[part, round(at)] = (right - left) / 2
    assert (drawn >= true * share * (1 - 1e-9) - 1e-12).all()  # in percent
    most = np.array(sizes) * share  # joint 3 is loaded through one link alone
    np.testing.assert_allclose(drawn[:, 2], most[:, 2], rtol=1e-9, atol=1e-12)
    words = figure.legends[0].get_title().get_text()
    assert "one standard deviation of its mean size, at most" in words


def test_hatched_are_net_torques_that_two_deviations_leave_open_where_largest(result: Analysis) -> None:
    pytest.importorskip("matplotlib")
    values = result.values.copy()
    values[[row for row, (name, _) in enumerate(result.rows.places) if name.startswith("sd/")]] *= 3.0
    figure = replace(result, values=values).figure("shares")
    hatched = {
        (round(bar.get_y() + 0.32), round(bar.get_x(), 6))
        for bar in figure.axes[0].patches
        if bar.get_hatch() == "\\" * 6
    }
    expected, start = set(), np.zeros(3)
    terms: list[tuple[Any, Any]] = [(result.dense("tau_gravity"), 3 * result.dense("sd/tau_gravity"))]
    for k in range(3):
        both = [[result.dense(f"{of}{name}")[..., k] for name in ("tau_qdd", "tau_qd")] for of in ("", "sd/")]
        terms.append((sum(both[0]), 3 * sum(both[1])))
    nets = [net.sum(-1) for net, _ in terms]
    most = np.max([np.abs(net).max(axis=0) for net in nets], axis=0)
    whole = np.sum([np.abs(net).mean(axis=0) for net in nets], axis=0)
    for net, (_, sd) in zip(nets, terms, strict=True):
        for i in range(3):
            at = np.abs(net[:, i]).argmax()
            size = abs(net[at, i])
            if 1e-3 * most[i] < size < 2 * sd[at, i].sum():
                expected.add((i, round(start[i], 6)))
            start[i] += 100 * np.abs(net[:, i]).mean() / whole[i]
    assert hatched == expected
    assert 0 < len(expected) < 12
    assert "no certain sign" in [text.get_text() for text in figure.legends[0].get_texts()]


def test_the_figure_of_causes_has_a_band_and_whiskers(result: Analysis) -> None:
    pytest.importorskip("matplotlib")
    figure = result.figure("causes:joint3")
    (band,) = halves(figure.axes[0])
    np.testing.assert_allclose(band, result["sd/tau/joint3"], rtol=1e-12)
    means, sizes = (
        next(one for one in panel.containers if hasattr(one, "has_xerr")).lines[2][0].get_segments()
        for panel in figure.axes[1:3]
    )
    spread, labels = result["sd/tau_gravity/joint3/link3"], figure.axes[1].get_yticklabels()
    at = [label.get_text() for label in labels].index("gravity")
    assert np.ptp(means[at][:, 0]) / 2 == pytest.approx(spread.mean())
    assert np.ptp(sizes[at][:, 0]) / 2 == pytest.approx(spread.mean())
    assert "Bands are one standard deviation to either side." in figure.get_supxlabel()


@pytest.mark.parametrize(
    ("figure", "quantity", "column"),
    [
        ("power", "power", "power/joint1"),
        ("reaction:joint2", "reaction", "reaction/joint2/moment_z"),
        ("induced:joints", "acc", "acc/joints/joint1"),
        ("trace:joint1", "tau_qd", ""),
        ("energy", "energy_kinetic", ""),
        ("paper:joint1", "tau_qd", ""),
    ],
)
def test_whatever_has_a_deviation_has_a_band(
    result: Analysis, figure: str, quantity: str, column: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    pytest.importorskip("matplotlib")
    several = () if quantity in ("tau_qd",) else (quantity,)
    told = told_for(result, several, monkeypatch)
    drawn = told.figure(figure)
    panels = [panel for panel in drawn.axes if any(patch.get_alpha() == FAINT for patch in panel.patches)]
    assert panels
    assert "one standard deviation" in " ".join(drawn.get_supxlabel().split())
    if column:
        found = [half for panel in panels for half in halves(panel)]
        spread = told[f"sd/{column}"]
        assert any(np.allclose(half, spread, rtol=1e-9) for half in found)
    else:
        assert "one standard" not in without(told).figure(figure).get_supxlabel()


def without(result: Analysis) -> Analysis:
    """Return a result without any deviation."""
    kept = [row for row, (name, _) in enumerate(result.rows.places) if not name.startswith("sd/")]
    rows = ResultRows(result.rows.axes, result.rows.points, tuple(result.rows.places[row] for row in kept))
    totals = Totals(result.totals.mean[kept], result.totals.peak[kept], result.totals.rms[kept])
    return replace(result, rows=rows, values=result.values[kept], totals=totals, uncertain=None, peaks=())


def test_bands_of_a_long_movement_hold_every_sample(tmp_path: Path) -> None:
    pytest.importorskip("matplotlib")
    (tmp_path / "bodies.toml").write_text(FILE)
    log = write_csv(tmp_path / "log.csv", smooth(7000, 3))
    result = analyze(log, PLANAR3, uncertain=tmp_path / "bodies.toml")
    time, low, high = unpacked_bands(result, "tau_qd 0 2 2")
    share, spread = result["tau_qd/joint1/link3/joint3"], result["sd/tau_qd/joint1/link3/joint3"]
    size = -(-len(share) // len(time))
    for at in range(len(time)):
        piece = slice(at * size, (at + 1) * size)
        assert low[at] == pytest.approx((share - spread)[piece].min(), rel=1e-6, abs=1e-7)
        assert high[at] == pytest.approx((share + spread)[piece].max(), rel=1e-6, abs=1e-7)
        assert time[at] == pytest.approx(result.time[piece].mean())


def unpacked_bands(result: Analysis, key: str) -> tuple[Any, Any, Any]:
    """Return times and edges of the band of a curve on the page."""
    curves = json.loads(page_data(result))["curves"]
    bands = curves["bands"]
    time = np.frombuffer(base64.b64decode(bands["time"]), "<f8")
    at = bands["curves"].index(curves["keys"].index(key))
    low, high = (
        np.frombuffer(base64.b64decode(bands[e]), "<f4").reshape(-1, len(time)) for e in ("low", "high")
    )
    return time, low[at], high[at]


def test_assumptions_are_told_and_those_that_nobody_knew_of_too() -> None:
    links = [{"name": name, "mass": 0.1, "centre": [0.01] * 3, "radii": 0.0} for name in "abc"]
    links[1]["mass"], links[2]["centre"] = 0.025, [0.01, 0.0, 0.002]
    record = {
        "file": "x.toml",
        "links": links,
        "body_mass": 0.05,
        "segments": ["a", "b"],
        "correlation": [[1]],
    }
    noise = [{"joint": name, "sd": sd, "unit": "rad"} for name, sd in (("d", 1e-3), ("e", 1e-3), ("f", 2e-3))]
    motion = {
        "noise": noise,
        "correlation": [[1.0, 0.2, 0.0], [0.2, 1.0, -0.4], [0.0, -0.4, 1.0]],
        "estimated_from_what_the_filter_took_away": True,
    }
    loads = [{"name": "tip", "force": [5.0] * 3, "moment": [0.0] * 3, "point": [0.005] * 3}]
    more = {"motion": motion, "loads": loads, "axes": {"elbow": 0.01}, "certain": "springs"}
    told = list(assumptions(record | more))
    assert told == [
        "Masses: ± 10 %; b ± 2.5 %.",
        "Centres of mass: ± 10 mm; c ± 10/0/2 mm.",
        "Radii of gyration: certain.",
        "Forces of loads: ± 5 N.",
        "Free moments of loads: certain.",
        "Points of loads: ± 5 mm.",
        "Mass of the body: ± 5 %, with fixed parts: a, b.",
        "Errors of masses go together as the file says.",
        "Noise of positions, from what the filter took away: ± 1 mrad; f ± 2 mrad; noise of joints goes"
        " together, by correlations up to 0.40.",
        "Axes: elbow 0.01.",
        "Counted as certain: springs.",
    ]
