"""The page draws of an instant and over time what the result has: curves, map, figure, downloads."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.motion_logs import smooth, write_csv
from helpers.urdf_text import joint, link, robot
from linkwise import Load, generate, read_system, write_package
from linkwise.analysis import Analysis, analyze
from linkwise.analysis.show.page import report
from selenium.webdriver.support.wait import WebDriverWait

pytestmark = pytest.mark.browser
ARM = robot(
    *map(link, "abcd"),
    joint("shoulder", "a", "b", inner='<dynamics damping="0.5" friction="0.2"/>'),
    joint("slide", "b", "c", type="prismatic", inner='<dynamics damping="3"/>'),
    joint("wrist", "c", "d"),
)
JOINTS, LINKS, OWN = ("shoulder", "slide", "wrist"), ("b", "c", "d"), ("damping", "friction")
SAMPLES, AT = 120, 47


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Analysis:
    """An arm with a slide and losses that bears a load, all of whose samples are on the page."""
    folder = tmp_path_factory.mktemp("drawn")
    (folder / "arm.urdf").write_text(ARM)
    write_package(generate(read_system(folder / "arm.urdf"), ["numpy"]), folder / "arm")
    log = write_csv(folder / "=log.csv", smooth(SAMPLES, 3) + np.array([2.0, 0.0, 0.0, 0.0]), JOINTS)
    push = Load("=push", "d", (3.0, -4.0, 5.0), (0.3, 0.2, -0.1), (0.1, 0.2, 0.3))
    return analyze(log, folder / "arm", loads=[push])


@pytest.fixture(scope="module")
def opened(driver: Any, result: Analysis, tmp_path_factory: pytest.TempPathFactory) -> Any:
    place: Path = tmp_path_factory.mktemp("page") / "report.html"
    place.write_text(report(result), encoding="utf-8")
    open_page(driver, place)
    return driver


@pytest.fixture
def page(opened: Any) -> Iterator[Any]:
    """The page at an instant, with all causes, all links, motions apart and each joint by itself."""
    usual = {"order": "everything", "motion": "apart", "link": "", "scale": "own", "joint": 0, "slider": AT}
    for name, value in usual.items():
        choose(opened, name, value)
    yield opened
    assert opened.get_log("browser") == []


def open_page(driver: Any, place: Path) -> None:
    driver.get(place.as_uri())
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


def causes(result: Analysis, i: str, link: str | None, words: tuple[str, ...]) -> dict[str, Any]:
    """Net torque on a joint over time by cause, of a link or of all together; what has none is left out."""
    table, some = result.table, LINKS if link is None else (link,)
    own = OWN if link is None else ()
    names = {"gravity": [f"tau_gravity/{i}/{j}" for j in some]}
    names |= {"load =push": [f"tau_load/{i}/=push"] if link is None else []}
    names |= {what: [f"tau_{what}/{i}"] for what in own}
    kinds = {"acceleration": ["tau_qdd"], "velocity": ["tau_qd"], "motion": ["tau_qdd", "tau_qd"]}
    for word in words:
        names |= {
            f"{k} {word}": [f"{kind}/{i}/{j}/{k}" for kind in kinds[word] for j in some] for k in JOINTS
        }
    there = {cause: [table[name] for name in columns if name in table] for cause, columns in names.items()}
    return {cause: np.sum(some, axis=0) for cause, some in there.items() if some}


def there_is(curves: dict[str, Any]) -> dict[str, Any]:
    """Return the curves that are more than rounding beside the largest."""
    sizes = {cause: np.abs(curve).mean() for cause, curve in curves.items()}
    return {cause: curves[cause] for cause, size in sizes.items() if size >= 1e-12 * max(sizes.values())}


@pytest.mark.parametrize("motion", ["apart", "together"])
@pytest.mark.parametrize("link", [None, "c"])
def test_curves_are_net_torques_by_cause_in_the_joints_unit(
    page: Any, result: Analysis, link: str | None, motion: str
) -> None:
    choose(page, "motion", motion)
    choose(page, "link", "" if link is None else LINKS.index(link))
    words = ("motion",) if motion == "together" else ("acceleration", "velocity")
    for i, name in enumerate(JOINTS):
        choose(page, "joint", i)
        shown = page.execute_script(
            "return document.getElementById('curves').data"
            ".map((c) => [c.name, Array.from(c.x), Array.from(c.y)])"
        )
        expected = there_is(causes(result, name, link, words))
        column = f"tau/{name}" + (f"/{link}" if link else "")
        if column in result.table:
            expected = {"all causes together": result.table[column]} | expected
        assert [one[0] for one in shown] == list(expected)
        scale = max((np.abs(curve).max() for curve in expected.values()), default=0.0)
        for cause, x, y in shown:
            np.testing.assert_array_equal(x, result.time)
            np.testing.assert_allclose(y, expected[cause], rtol=0, atol=1e-14 * scale, err_msg=cause)
        unit = "return document.getElementById('curves').layout.yaxis.title.text"
        assert page.execute_script(unit) == ("N" if name == "slide" else "N·m")
        assert page.find_element("id", "numbers-unit").text == ("N" if name == "slide" else "N·m")


def test_the_table_has_each_causes_share_of_all_sizes_at_the_instant(page: Any, result: Analysis) -> None:
    for i, name in enumerate(JOINTS):
        choose(page, "joint", i)
        rows = page.execute_script(
            "return [...document.querySelectorAll('#numbers tbody tr')]"
            ".map((row) => [...row.cells].map((cell) => cell.textContent))"
        )
        net = causes(result, name, None, ("acceleration", "velocity"))
        size = sum(abs(curve[AT]) for curve in net.values())
        shares = {cause: f"{100 * abs(curve[AT]) / size:.1f} %" for cause, curve in net.items()}
        assert {row[0]: row[2] for row in rows[:-1]} == shares
        whole = result.table[f"tau/{name}"]
        assert float(rows[-1][1]) == pytest.approx(whole[AT], rel=6e-3)
        assert float(rows[-1][3]) == pytest.approx(np.abs(whole).mean(), rel=6e-3)


def peaks(result: Analysis) -> Any:
    """Largest size of each cause on each joint over the movement, (joints, causes)."""
    every = [causes(result, name, None, ("motion",)) for name in JOINTS]
    order = ["gravity", "load =push", *OWN, *(f"{k} motion" for k in JOINTS)]
    none = np.zeros(SAMPLES)
    net = np.array([[some.get(cause, none) for cause in order] for some in every])
    return order, net[..., AT], np.abs(net).max(axis=-1)


def test_colours_of_the_map_are_shares_of_the_largest_over_the_movement(page: Any, result: Analysis) -> None:
    choose(page, "motion", "together")
    order, now, most = peaks(result)
    for scale, reach in (("own", most.max(axis=1, keepdims=True)), ("alike", most.max())):
        choose(page, "scale", scale)
        z = page.execute_script("return document.getElementById('map').data[0].z")
        found = np.array([[x or 0.0 for x in row] for row in z])
        np.testing.assert_allclose(found, now / reach, rtol=1e-12, atol=1e-14, err_msg=scale)
    told = page.execute_script("return document.getElementById('map').data[0].customdata")
    assert [[cell[0] for cell in row] for row in told] == [[name] * len(order) for name in JOINTS]
    assert [cell[1] for cell in told[0]] == order
    assert [row[0][2] for row in told] == ["N·m", "N", "N·m"]


def test_kinds_of_motion_are_headed_where_they_begin(page: Any) -> None:
    heads = "return document.getElementById('map').layout.annotations.map(({text, x}) => [text, x])"
    assert page.execute_script(heads) == [["<b>acceleration of</b>", 3.5], ["<b>velocity of</b>", 6.5]]
    choose(page, "motion", "together")
    assert page.execute_script(heads) == [["<b>motion of</b>", 3.5]]


def test_the_time_line_stands_at_the_instant(page: Any, result: Analysis) -> None:
    whole = [result.time[0], result.time[-1]]
    for first, last in (whole, [result.time[AT - 10], result.time[AT + 30]], whole):
        share = page.execute_script(
            "return Plotly.relayout('curves', {'xaxis.range': [arguments[0], arguments[1]]}).then(() => {"
            "const area = document.querySelector('#curves .nsewdrag').getBoundingClientRect();"
            "const line = document.getElementById('curves-cursor').getBoundingClientRect();"
            "return (line.left + line.width / 2 - area.left) / area.width; })",
            first,
            last,
        )
        assert share == pytest.approx((result.time[AT] - first) / (last - first), abs=2e-3)
    assert page.find_element("id", "now").text == f"{result.time[AT]:.2f} s"


@pytest.mark.parametrize(
    ("order", "said"),
    [
        ("everything", "Gravity and loads are in."),
        ("movement", "Left out: gravity, load =push."),
        ("tau_load", "Left out: gravity, and other causes than those chosen."),
        ("named", "Left out: load =push, and other causes than those chosen."),
    ],
)
def test_captions_say_which_causes_are_left_out(page: Any, order: str, said: str) -> None:
    choose(page, "order", order)
    moved = "A motion is acceleration and velocity together."
    if order.startswith("tau_q"):
        moved = "Acceleration and velocity are apart here; a motion is both together."
    caption = page.find_element("id", "shares-caption").text
    moves = order in ("everything", "movement") or order.startswith("tau_q")
    assert caption.endswith(f"{said} {moved}" if moves else said)


def test_a_click_on_the_map_picks_joint_and_cause_and_another_lets_go(page: Any) -> None:
    choose(page, "motion", "together")
    click = "document.getElementById('map').emit('plotly_click', {points: [{x: 5, y: 2}]});"
    frame = (
        "const {shapes} = document.getElementById('map').layout, s = shapes.at(-1);"
        "return [s.type, s.x0, s.x1, s.y0, s.y1]"
    )
    assert page.execute_script(click + frame) == ["rect", 4.5, 5.5, 1.5, 2.5]
    assert page.find_element("id", "joint").get_attribute("value") == "2"
    picked = page.find_elements("css selector", "#numbers tr.picked")
    assert [row.find_element("css selector", "td").text for row in picked] == ["slide motion"]
    assert page.execute_script(click + frame) == ["rect", -0.5, 6.5, 1.5, 2.5]
    assert page.find_elements("css selector", "#numbers tr.picked") == []


def test_links_of_the_figure_have_the_colour_of_what_they_ask_of_the_joint(
    page: Any, result: Analysis
) -> None:
    looks = page.execute_script(
        "return ['--low', '--mid', '--high'].map((name) =>"
        "getComputedStyle(document.documentElement).getPropertyValue(name).trim())"
    )
    low, mid, high = (np.array([int(hex[at : at + 2], 16) for at in (1, 3, 5)]) for hex in looks)
    choose(page, "motion", "together")
    for i, name in enumerate(JOINTS):
        choose(page, "joint", i)
        strokes = page.execute_script(
            "return [...document.querySelectorAll('#stick line[stroke-width=\"10\"]')]"
            ".map((line) => line.getAttribute('stroke').match(/\\d+/g).map(Number))"
        )
        asked = [result.table.get(f"tau/{name}/{j}", np.zeros(SAMPLES))[AT] for j in LINKS]
        shares = np.array(asked) / peaks(result)[2][i].max()
        expected = [mid + (np.where(x < 0, low, high) - mid) * min(1.0, abs(x)) for x in shares]
        np.testing.assert_allclose(strokes, expected, atol=0.5 + 1e-9)
        rings = page.execute_script(
            "return [...document.querySelectorAll('#stick circle')].map((c) => c.getAttribute('r'))"
        )
        assert [r for r in rings if r != "2.5"] == ["9" if k == i else "5" for k in range(3)]


def saved(page: Any, button: str) -> list[list[str]]:
    """The cells of a table that a button saves."""
    text = page.execute_async_script(
        "const [button, done] = arguments; const made = URL.createObjectURL;"
        "URL.createObjectURL = (blob) => { blob.text().then(done); return made.call(URL, blob); };"
        "document.getElementById(button).click(); URL.createObjectURL = made;",
        button,
    )
    return [row.split(",") for row in text.split("\r\n")[:-1]]


def test_saved_tables_have_the_numbers_that_are_drawn(page: Any, result: Analysis) -> None:
    choose(page, "joint", 1)
    head, *rows = saved(page, "save-curves-csv")
    expected = causes(result, "slide", None, ("acceleration", "velocity"))
    assert head == ["time", *expected]
    values = np.array(rows, dtype=float).T
    np.testing.assert_array_equal(values[0], result.time)
    np.testing.assert_allclose(values[1:], list(expected.values()), rtol=1e-12, atol=1e-14)
    choose(page, "motion", "together")
    order, now, _ = peaks(result)
    head, *rows = saved(page, "save-map-csv")
    assert head == [f"joint at {float(result.time[AT])!r} s", *order]
    assert [row[0] for row in rows] == list(JOINTS)
    np.testing.assert_allclose(np.array([row[1:] for row in rows], dtype=float), now, rtol=1e-12, atol=1e-14)


def test_energies_are_drawn_to_the_largest_and_summed_up_by_joint(page: Any, result: Analysis) -> None:
    choose(page, "span", "now")
    heat = "const {zmin, zmax} = document.getElementById('power').data[0]; return [zmin, zmax]"
    peak = [
        np.abs(values).max()
        for column, values in zip(result.columns, result.values, strict=True)
        if column.quantity in ("power_link", "power_load")
    ]
    assert page.execute_script(heat) == pytest.approx([-max(peak), max(peak)], rel=1e-12)
    choose(page, "span", "movement")
    labels = page.execute_script("return document.getElementById('power').data[0].node.label")
    net = np.concatenate([result.work.net, result.load_work.net], axis=1)
    least = 0.005 * max(np.abs(net).max(), np.abs(net.sum(axis=0)).max())
    for i, name in enumerate(JOINTS):
        big = net[i][np.abs(net[i]) > least]
        sums = [big[big > 0].sum(), -big[big < 0].sum()]
        shown = [float(label.split()[-2]) for label in labels if label.startswith(f"{name} ")]
        assert sorted(shown) == pytest.approx(sorted(x for x in sums if x), rel=6e-3)


def test_the_convention_that_does_not_close_is_told(page: Any, result: Analysis, tmp_path: Path) -> None:
    assert not page.find_element("id", "gradient").is_displayed()
    made = replace(result, processing=replace(result.processing, convention="gradient"))
    (tmp_path / "report.html").write_text(report(made), encoding="utf-8")
    open_page(page, tmp_path / "report.html")
    assert "sum to twice the velocity force" in page.find_element("id", "gradient").text
