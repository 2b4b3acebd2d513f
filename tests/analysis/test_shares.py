"""The largest loads of a joint: bars, notebook, page and its table say the same, and what a table's columns
say.

Each cause counts by the mean size of its net torque on a joint, links summed first: of an arm that is folded
back the links' weights cancel at the shoulder, so that their sizes, added up, would tell another story.
"""

import html
import json
import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
from helpers.motion_logs import JOINTS, PLANAR3, write_csv
from linkwise.analysis import Analysis, analyze
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.request import Outputs, Request
from linkwise.analysis.result_rows import Place, ResultRows
from linkwise.analysis.run import analyze_to
from linkwise.analysis.show import figure_bytes
from linkwise.analysis.show.cause_numbers import cause_numbers
from linkwise.analysis.show.page import page_data, report
from linkwise.analysis.whole_movement import Totals, Work
from linkwise.progress import silent
from numpy.typing import NDArray
from selenium.webdriver.support.wait import WebDriverWait

SAMPLES = 12_001
"""More than a part of a result has, and than a page."""
CROWD = tuple(f"j{i}" for i in range(14))
"""Joints of which bars have but some."""
BOTH = ("acceleration", "velocity")
MOTION = ("motion",)
WORDS = {"acceleration": "tau_qdd", "velocity": "tau_qd", "motion": "tau_q(?:dd|d)"}
Shares = dict[str, NDArray[np.float64]]
"""Mean size of each cause on each joint, (joints,)."""


@dataclass(frozen=True)
class Columns:
    """Columns of a table by name, and the names of joints."""

    table: dict[str, Any]
    joints: tuple[str, ...]

    def curve(self, joint: str, cause: str, link: str = "[^/]+") -> Any:
        """Each column of the cause on the joint, (columns, samples)."""
        mover, _, word = cause.partition(" ")
        name = f"{WORDS[word]}/{joint}/{link}/{mover}" if word else f"tau_gravity/{joint}/{link}"
        found = [values for column, values in self.table.items() if re.fullmatch(name, column)]
        return np.array(found).reshape(len(found), len(self.table["time"]))

    def sizes(self, words: Iterable[str], link: str = "[^/]+", gravity: bool = True) -> Shares:
        """Mean sizes of net torques, by cause."""
        causes = [f"{joint} {word}" for word in words for joint in self.joints]
        return {
            cause: np.array([np.abs(self.curve(j, cause, link).sum(axis=0)).mean() for j in self.joints])
            for cause in [*(["gravity"] if gravity else []), *causes]
        }


def percent(sizes: Shares) -> Shares:
    whole = np.sum(list(sizes.values()), axis=0)
    return {cause: 100 * size / whole for cause, size in sizes.items()}


def largest_first(sizes: Shares, i: int) -> list[str]:
    return sorted(sizes, key=lambda cause: -sizes[cause][i])


def folded() -> NDArray[np.float64]:
    """An arm whose second link lies back over the first, and shakes."""
    time = np.arange(SAMPLES) / 1000
    q1, q2 = 0.1 + 0.12 * np.sin(20 * time), np.pi + 0.15 * np.sin(15 * time + 1)
    return np.column_stack([time, q1, q2, 0.2 * np.sin(18 * time + 2)])


@pytest.fixture(scope="module")
def place(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder that the command writes, while values lie in a file."""
    made: Path = tmp_path_factory.mktemp("shares")
    given = Request(outputs=Outputs(figures=("shares",))), silent
    analyze_to(made / "out", write_csv(made / "log.csv", folded()), load_robot(PLANAR3), *given)
    return made


@pytest.fixture(scope="module")
def analysis(place: Path) -> Analysis:
    found = analyze(place / "log.csv", PLANAR3)
    assert len(list(found.parts())) > 1
    return found


@pytest.fixture(scope="module")
def columns(place: Path) -> Columns:
    """Return the columns that the command wrote."""
    table = pq.read_table(place / "out" / "analysis.parquet")
    return Columns({name: table[name].to_numpy() for name in table.column_names}, JOINTS)


@pytest.fixture(scope="module")
def crowd(analysis: Analysis) -> Analysis:
    """Return columns of 14 joints."""
    return crowd_of(CROWD, analysis)


def crowd_of(joints: tuple[str, ...], analysis: Analysis) -> Analysis:
    """Joints, each loaded through two links that cancel, more or less."""
    draw, count = np.random.default_rng(4), range(len(joints))
    pairs: list[tuple[Any, int, int | None]] = [("tau_gravity", i, None) for i in count]
    pairs += [(quantity, i, k) for quantity in ("tau_qdd", "tau_qd") for i in count for k in count]
    places: list[Place] = [("time", ())]
    values = [np.arange(400) / 100]
    for quantity, i, k in pairs:
        first = draw.uniform(0.1, 1.0) * draw.normal(size=400)
        for j, size in ((0, 1.0), (1, draw.uniform(-1.0, 0.5))):
            places.append((quantity, (i, j) if k is None else (i, j, k)))
            values.append(size * first)
    robot = replace(analysis.robot, joints=joints, links=joints, units=("rad",) * len(joints), tree=None)
    none = np.zeros((len(joints), len(joints)))
    size = np.abs(values)
    rms = np.sqrt(np.square(values).mean(axis=1))
    totals = Totals(size.mean(axis=1), size.max(axis=1), rms)
    about: Any = {"robot": robot, "totals": totals, "works": {"power_link": Work(none, none)}, "total": 400}
    return replace(analysis, rows=ResultRows.of(robot, places), values=np.array(values), **about)


def test_links_cancel_here_so_that_their_sizes_would_tell_another_cause(columns: Columns) -> None:
    net = columns.sizes(MOTION)
    apart = {cause: np.abs(columns.curve("joint1", cause)).mean(axis=1).sum() for cause in net}
    assert max(apart, key=lambda cause: apart[cause]) == "gravity"
    assert largest_first(net, 0)[0] == "joint1 motion"


def bars(figure: Any, panel: int) -> Shares:
    """Widths by cause in a figure of shares, (joints,), of everything (0) or of the movement alone (1)."""
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    shown = figure.axes[panel].containers
    widths = [np.array([patch.get_width() for patch in bar]) for bar in shown]
    return dict(zip(labels[len(labels) - len(shown) :], widths, strict=True))


def assert_same(found: Shares, expected: Shares) -> None:
    assert found.keys() == expected.keys()
    for cause, share in expected.items():
        np.testing.assert_allclose(found[cause], share, rtol=1e-9, atol=1e-12)


def test_the_figure_has_mean_sizes_of_net_torques(place: Path, analysis: Analysis, columns: Columns) -> None:
    figure = analysis.figure("shares")
    for panel in (0, 1):
        sizes = columns.sizes(MOTION, gravity=panel == 0)
        assert_same(bars(figure, panel), percent(sizes))
        assert figure.axes[panel].get_xlabel() == "mean size of the net torque, % of all"
    assert (place / "out" / "shares.png").read_bytes() == figure_bytes(analysis, "shares")


def notebook(result: Analysis) -> list[tuple[str, str]]:
    """Return the largest cause of each joint and its share, as the notebook shows them."""
    rows = re.findall(r"<tr[^>]*>(.*?)</tr>", result._repr_html_())[1:]
    cells = [[html.unescape(cell) for cell in re.findall(r"<td[^>]*>(.*?)</td>", row)] for row in rows]
    return [(row[-4], row[-3]) for row in cells]


def test_the_notebook_says_the_largest_of_the_figures_parts(analysis: Analysis, columns: Columns) -> None:
    share = percent(columns.sizes(MOTION))
    assert_same(bars(analysis.figure("shares"), 0), share)
    first = [largest_first(share, i)[0] for i in range(3)]
    assert notebook(analysis) == [(cause, f"{share[cause][i]:.0f} %") for i, cause in enumerate(first)]


def test_figures_notebook_and_page_name_the_same_largest_motion(analysis: Analysis) -> None:
    """Either of a joint's acceleration and velocity is the largest alone, and both together the least."""
    rows, values = analysis.rows, analysis.values.copy()
    values[rows.numbers("tau_qdd", "tau_qd", cause=1)] = 0.0
    for name, size in (("tau_qdd", 300.0), ("tau_qd", -299.99)):
        values[rows.numbers(name, cause=1, link=2)] = size * np.sin(analysis.time)
    result = replace(analysis, values=values)
    columns = Columns(result.table, JOINTS)
    sizes = columns.sizes(MOTION)
    apart = columns.sizes(BOTH)
    assert [largest_first(apart, i)[0] for i in range(3)] == ["joint2 acceleration"] * 3
    first = [largest_first(sizes, i)[0] for i in range(3)]
    assert "joint2 motion" not in first
    shown = bars(result.figure("shares"), 0)
    assert [max(shown, key=lambda cause: shown[cause][i]) for i in range(3)] == first
    assert [cause for cause, _ in notebook(result)] == first
    page = json.loads(page_data(result))["curves"]
    mean = dict(zip(page["keys"], page["mean"], strict=True))
    for i in range(3):
        by = {f"{JOINTS[k]} motion": mean.get(f"motion {i} {k} null", 0.0) for k in range(3)}
        by["gravity"] = mean[f"tau_gravity {i} null null"]
        assert max(by, key=lambda cause: by[cause]) == first[i]
        numbers = cause_numbers(result, i)
        assert numbers.labels[1] == first[i]
        np.testing.assert_allclose(numbers.phases[0].size[1], sizes[first[i]][i])


def few_of(columns: Columns, word: str, gravity: bool = True) -> tuple[Shares, list[str]]:
    """Return, of many joints, the parts of the bars, and which other motion is the largest of each."""
    sizes = columns.sizes((word,), gravity=gravity)
    by = np.array([sizes[f"{joint} {word}"] for joint in columns.joints]).T
    others = by * (1 - np.eye(len(by)))
    largest = others.max(axis=1)
    fixed = {"gravity": sizes["gravity"]} if gravity else {}
    parts = fixed | {"own": by.diagonal(), "other": largest, "rest": others.sum(axis=1) - largest}
    return percent(parts), [columns.joints[k] for k in others.argmax(axis=1)]


def test_many_joints_have_the_same_sizes(crowd: Analysis) -> None:
    every = Columns(crowd.table, CROWD)
    figure = crowd.figure("shares")
    for panel in (0, 1):
        expected, first = few_of(every, "motion", panel == 0)
        found = bars(figure, panel)
        np.testing.assert_allclose(list(found.values()), list(expected.values()), rtol=1e-9)
    assert list(found)[-1] == "motions of all other joints, shares added"
    assert [text.get_text() for text in figure.axes[2].get_yticklabels()] == first


def opened(driver: Any, address: str) -> None:
    """Open a page and wait until it is unpacked and drawn."""
    driver.get(address)
    WebDriverWait(driver, 20).until(
        lambda driver: driver.execute_script("return 'drawn' in document.documentElement.dataset")
    )


def choose(page: Any, name: str, value: object) -> None:
    page.execute_script(
        "const e = document.getElementById(arguments[0]); e.value = arguments[1];"
        "e.dispatchEvent(new Event('input', {bubbles: true}));"
        "e.dispatchEvent(new Event('change', {bubbles: true}));",
        name,
        str(value),
    )


def page_bars(page: Any) -> Shares:
    """Return the bars that the page draws."""
    shown = page.execute_script(
        "return document.getElementById('shares').data.map((bar) => [bar.name, Array.from(bar.x)])"
    )
    return {name: np.array(widths) for name, widths in shown}


def page_table(page: Any) -> dict[str, float]:
    """Causes of the page's table in their order, without the sum below, and their mean sizes as shown."""
    rows = page.execute_script(
        "return [...document.querySelectorAll('#numbers tbody tr:not(.sum)')]"
        ".map((row) => [row.cells[0].textContent, row.cells[3].textContent])"
    )
    return {name: float(size) for name, size in rows}


@pytest.mark.browser
@pytest.mark.parametrize(
    ("chosen", "words", "gravity"),
    [
        ({}, MOTION, True),
        ({"motion": "apart"}, BOTH, True),
        ({"motion": "apart", "order": "movement"}, BOTH, False),
        ({"order": "tau_qd"}, ("velocity",), False),
        ({"link": 1}, MOTION, True),
        ({"link": 2, "order": "movement"}, MOTION, False),
    ],
    ids=str,
)
def test_bars_and_table_of_the_page_are_those_of_all_samples(
    driver: Any, place: Path, columns: Columns, chosen: dict[str, object], words: Any, gravity: bool
) -> None:
    opened(driver, (place / "out" / "report.html").as_uri())
    for name, value in chosen.items():
        choose(driver, name, value)
    link = f"link{int(str(chosen['link'])) + 1}" if "link" in chosen else "[^/]+"
    sizes = columns.sizes(words, link, gravity)
    with np.errstate(invalid="ignore"):  # a view of parts counts in no share
        counted = columns.sizes(MOTION, link, gravity) if words == BOTH else sizes
        share = {cause: np.nan_to_num(values) for cause, values in percent(counted).items()}
    assert_same(page_bars(driver), share)
    through = "all links together" if "link" not in chosen else f"through {link}"
    said = f"net torque, {through}, over all 12,001 samples"
    assert (
        f"the mean size of its {said}, in % of all causes' sizes."
        in driver.find_element("id", "shares-caption").text
    )
    assert (
        f"On average: the mean size of each cause's {said}."
        in driver.find_element("id", "numbers-caption").text
    )
    for i, joint in enumerate(JOINTS):
        choose(driver, "joint", i)
        there = [cause for cause in largest_first(sizes, i) if len(columns.curve(joint, cause, link))]
        shown = page_table(driver)
        assert list(shown) == there
        assert list(shown.values()) == pytest.approx([sizes[cause][i] for cause in there], rel=6e-3)
    assert driver.get_log("browser") == []


@pytest.mark.browser
def test_curves_that_are_thinned_out_stand_at_samples_of_their_own(
    driver: Any, place: Path, columns: Columns
) -> None:
    opened(driver, (place / "out" / "report.html").as_uri())
    table = columns.table
    moved = np.abs([values for name, values in table.items() if re.match("tau_q(?:dd|d)/", name)]).max(axis=0)
    now = float(driver.find_element("id", "now").text.split()[0])
    assert now == pytest.approx(table["time"][moved.argmax()], abs=0.01)
    loaded = [np.abs(table[f"tau/{joint}"]).mean() for joint in JOINTS]
    assert driver.find_element("id", "joint").get_attribute("value") == str(int(np.argmax(loaded)))
    for i, joint in enumerate(JOINTS):
        choose(driver, "joint", i)
        shown = driver.execute_script(
            "return document.getElementById('curves').data"
            ".map((c) => [c.name, Array.from(c.x), Array.from(c.y)])"
        )
        for name, x, y in shown:
            whole = name == "all causes together"
            curve = table[f"tau/{joint}"] if whole else columns.curve(joint, name).sum(axis=0)
            at = np.rint(np.array(x) * 1000).astype(int)
            assert len(at) < 0.2 * SAMPLES
            assert (np.diff(at) >= 0).all()
            np.testing.assert_allclose(y, curve[at], rtol=1e-6, atol=1e-6 * np.abs(curve).max(), err_msg=name)
            assert (max(y), min(y)) == pytest.approx((curve.max(), curve.min()), rel=1e-6)


@pytest.mark.browser
@pytest.mark.parametrize(("order", "word"), [("everything", "motion"), ("tau_qdd", "acceleration")])
def test_bars_of_many_joints_are_the_same_on_the_page(
    driver: Any, crowd: Analysis, tmp_path: Path, order: str, word: str
) -> None:
    (tmp_path / "report.html").write_text(report(crowd), encoding="utf-8")
    opened(driver, (tmp_path / "report.html").as_uri())
    expected, first = few_of(Columns(crowd.table, CROWD), word, order == "everything")
    for motion in ("together", "apart"):
        choose(driver, "motion", motion)
        choose(driver, "order", order)
        np.testing.assert_allclose(
            list(page_bars(driver).values()), list(expected.values()), rtol=1e-9, err_msg=motion
        )
        hover = driver.execute_script(
            "return document.getElementById('shares').data.at(-2).customdata.map((told) => told[1])"
        )
        assert hover == [f"{joint} {word}" for joint in first]
        caption = driver.find_element("id", "shares-caption").text
        assert caption.endswith("Of all other joints the shares are added up.")
        assert ("A motion is acceleration and velocity together." in caption) == (word == "motion")
    assert driver.get_log("browser") == []


@pytest.mark.browser
def test_the_table_of_many_causes_adds_up_the_smaller_ones(
    driver: Any, crowd: Analysis, tmp_path: Path
) -> None:
    (tmp_path / "report.html").write_text(report(crowd), encoding="utf-8")
    opened(driver, (tmp_path / "report.html").as_uri())
    every, rows = Columns(crowd.table, CROWD), "return [...document.querySelectorAll('#numbers tbody tr')]"
    rows += ".map((row) => [row.cells[0].textContent, Number(row.cells[1].dataset.value),"
    rows += "row.cells[2].textContent, row.cells[3].textContent])"
    choose(driver, "motion", "apart")
    choose(driver, "joint", 3)
    choose(driver, "slider", 123)
    sizes = every.sizes(BOTH)
    now = {cause: every.curve(CROWD[3], cause)[:, 123].sum() for cause in sizes}
    order = largest_first(sizes, 3)
    moved = [cause for cause in order if cause != "gravity"]
    named = [cause for cause in order if cause in ("gravity", *moved[:8])]
    *shown, (rest, x, share, most) = driver.execute_script(rows)
    assert [name for name, *_ in shown] == named
    assert [x for _, x, *_ in shown] == pytest.approx([now[cause] for cause in named], rel=1e-12)
    smaller = moved[8:]
    assert rest == f"{len(smaller)} others, each smaller"
    assert x == pytest.approx(sum(now[cause] for cause in smaller), rel=1e-9)
    assert share == f"{100 * abs(x) / sum(map(abs, now.values())):.1f} %"
    assert most == f"≤ {float(f'{sizes[smaller[0]][3]:.4g}'):g} each"
    traces = driver.execute_script("return document.getElementById('curves').data.map((c) => c.name)")
    assert sorted(traces) == sorted(["gravity", *moved[:6], *["22 others, each smaller"] * 22])
    driver.execute_script("document.getElementById('every-number').click()")
    assert [name for name, *_ in driver.execute_script(rows)] == order
    assert driver.get_log("browser") == []


@pytest.mark.browser
@pytest.mark.parametrize(("count", "alone", "rest"), [(6, 6, 0), (7, 7, 0), (8, 6, 2)])
def test_a_curve_of_others_is_never_of_one_motion_alone(
    driver: Any, analysis: Analysis, tmp_path: Path, count: int, alone: int, rest: int
) -> None:
    page = report(crowd_of(CROWD[:count], analysis))
    (tmp_path / "report.html").write_text(page, encoding="utf-8")
    opened(driver, (tmp_path / "report.html").as_uri())
    choose(driver, "motion", "together")
    traces = driver.execute_script("return document.getElementById('curves').data.map((c) => c.name)")
    assert sum(name.endswith(" motion") for name in traces) == alone
    assert traces[alone + 1 :] == [f"{rest} others, each smaller"] * rest
    assert driver.get_log("browser") == []
