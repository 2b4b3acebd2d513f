"""The page in a real browser: no error, the slider moves the map, the numbers are the file's."""

import json
from dataclasses import replace
from functools import partial
from itertools import pairwise
from pathlib import Path
from time import monotonic

import numpy as np
import pyarrow.parquet as pq
import pytest
from helpers import urdf_text
from helpers.motion_logs import LEG, PLANAR3, smooth, write_csv
from linkwise import generate, read_system, write_package
from linkwise.analysis import Contact, Contacts, Lowpass, Payload, Processing, analyze
from linkwise.analysis.certain_signs import plus_minus
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.loads import Load, Loads
from linkwise.analysis.payload import with_payloads
from linkwise.analysis.request import Outputs, Request
from linkwise.analysis.result_rows import Column, ResultRows, torque_places
from linkwise.analysis.run import analyze_to
from linkwise.analysis.show.page import report, stick_figure
from linkwise.analysis.term_rows import term_rows
from linkwise.analysis.whole_movement import Totals, Work
from linkwise.progress import silent
from selenium.webdriver.support.wait import WebDriverWait

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def result(tmp_path_factory) -> Path:
    """A result of 2,000 samples, so that the page shows every second one."""
    place = tmp_path_factory.mktemp("page")
    log = write_csv(place / "a<b>.csv", smooth(2000, 3))
    robot = load_robot(PLANAR3)
    analyze_to(place / "out", log, robot, Request(), silent)
    return place / "out"


def opened(driver, address):
    """Open a page and wait until it is unpacked and drawn."""
    driver.get(address)
    WebDriverWait(driver, 20).until(
        lambda driver: driver.execute_script("return 'drawn' in document.documentElement.dataset")
    )


@pytest.fixture
def page(driver, result):
    opened(driver, (result / "report.html").as_uri())
    yield driver
    assert driver.get_log("browser") == []


def choose(page, name, value):
    page.execute_script(
        "const e = document.getElementById(arguments[0]); e.value = arguments[1];"
        "e.dispatchEvent(new Event('input', {bubbles: true}));"
        "e.dispatchEvent(new Event('change', {bubbles: true}));",
        name,
        str(value),
    )


def shown_map(page):
    z, numbers = page.execute_script(
        "const {z, meta} = document.getElementById('map').data[0]; return [z, meta]"
    )
    return z, numbers


def test_it_says_what_it_shows(page):
    assert page.title == "planar3 · a<b>.csv"
    note = page.find_element("id", "reduced").text
    assert "of 2,000 samples the page shows one in 2, 1,000 in all" in note


def test_slider_moves_the_map_to_the_files_numbers(page, result):
    table = pq.read_table(result / "analysis.parquet")
    seen = []
    choose(page, "motion", "apart")
    choose(page, "order", "movement")
    for at in (0, 123, 999):
        choose(page, "slider", at)
        row = {name: table[name][2 * at].as_py() for name in table.column_names}
        z, numbers = shown_map(page)
        seen.append(z)
        for i in range(3):
            for k in range(3):
                for column, quantity in ((k, "tau_qdd"), (3 + k, "tau_qd")):
                    terms = [
                        row.get(f"{quantity}/joint{i + 1}/link{j + 1}/joint{k + 1}", 0.0) for j in range(3)
                    ]
                    assert numbers[i][column] == pytest.approx(sum(terms), rel=1e-13, abs=1e-300)
        assert page.find_element("id", "now").text == f"{row['time']:.2f} s"
    assert seen[0] != seen[1] != seen[2]


def test_what_rounding_leaves_is_shown_as_nothing(driver, tmp_path):
    log = smooth(300, 3)
    log[:, 2] = 0.3 + 1e-15 * np.sin(40 * log[:, 0])
    path, robot = write_csv(tmp_path / "log.csv", log), load_robot(PLANAR3)
    analyze_to(tmp_path / "out", path, robot, Request(), silent)
    opened(driver, (tmp_path / "out" / "report.html").as_uri())
    choose(driver, "motion", "apart")
    choose(driver, "slider", 150)
    choose(driver, "joint", 0)
    assert [name for name, *_ in driver.execute_script(TICKS, "xtick")] == [
        "gravity", "joint1", "joint3", "joint1", "joint3"
    ]  # fmt: skip
    assert "2 empty columns are left out." in driver.find_element("id", "map-caption").text
    rows = driver.execute_script(
        "return [...document.querySelectorAll('#numbers tbody tr')].map((row) =>"
        "[row.cells[0].textContent, row.cells[1].dataset.value, row.cells[1].textContent])"
    )
    told = {name: (float(value), text) for name, value, text in rows}
    value, text = told["joint2 acceleration"]
    assert 0 < abs(value) < 1e-10
    assert text == "0"
    assert {text for name, (_, text) in told.items() if not name.startswith("joint2")}.isdisjoint({"0"})


def test_numbers_in_the_table_are_the_files(page, result):
    table = pq.read_table(result / "analysis.parquet")
    choose(page, "motion", "apart")
    choose(page, "slider", 321)
    choose(page, "joint", 0)
    choose(page, "link", 2)
    choose(page, "order", "everything")
    cells = page.execute_script(
        "return [...document.querySelectorAll('#numbers td[data-value]')]"
        ".map((td) => [JSON.parse(td.dataset.columns), Number(td.dataset.value), td.textContent])"
    )
    assert len(cells) == 8  # three accelerations, three velocities, gravity, and their sum
    for (name,), value, text in cells:
        assert value == table[name][642].as_py()
        assert float(text) == pytest.approx(value, rel=6e-3)
    assert cells[-1][0] == ["tau/joint1/link3"]
    sizes = [np.abs(table[name].to_numpy()).mean() for (name,), _, _ in cells[:-1]]
    assert sizes == sorted(sizes, reverse=True)
    assert sum(value for _, value, _ in cells[:-1]) == pytest.approx(cells[-1][1], rel=1e-12)


def test_shares_that_the_cutoff_changes_are_listed_and_what_is_left_out_is_told(
    driver, tmp_path, monkeypatch
):
    log = write_csv(tmp_path / "log.csv", smooth(300, 3))
    found = analyze(log, PLANAR3, processing=Processing(lowpass=Lowpass(6.0)), cutoff_sweep=(4, 12, 3))
    sweep = found.cutoff_sweep
    for left, told in ((0, "left out."), (1, "left out, and 1 that change least.")):
        monkeypatch.setattr("linkwise.analysis.show.page_cutoff.MOST", len(sweep.listed) - left)
        (tmp_path / "report.html").write_text(report(found), encoding="utf-8")
        opened(driver, (tmp_path / "report.html").as_uri())
        assert driver.find_element("id", "cutoff-caption").text.endswith(told)
        driver.execute_script("document.getElementById('every-swept').click()")
        rows = driver.execute_script(
            "return [...document.querySelectorAll('#swept tbody tr')]"
            ".map((row) => [...row.cells].map((cell) => cell.textContent))"
        )
        assert len(rows) == len(sweep.listed) - left
    for cells, at in zip(rows, sweep.listed.tolist(), strict=False):
        ends = sweep.rms[at, [0, sweep.own, -1]]
        assert cells[1] == found.robot.joints[sweep.columns[at].joint]
        assert [float(cell) for cell in cells[3:6]] == pytest.approx(ends.tolist(), rel=6e-3)
    assert driver.get_log("browser") == []


def test_what_accelerates_a_point_is_shown_by_source_and_adds_up(driver, tmp_path):
    log, robot = write_csv(tmp_path / "log.csv", smooth(300, 3)), load_robot(PLANAR3)
    wanted = Outputs("csv", induced=("joints", "link3,0.25,0,0"))
    loads = Loads.of([Load("pull", "link3", force=(0.0, -5.0, 0.0))], None)
    result, _ = analyze_to(tmp_path / "out", log, robot, Request(outputs=wanted, loads=loads), silent)
    opened(driver, (tmp_path / "out" / "report.html").as_uri())
    curves = "return [...document.getElementById('sourced').data].map((c) => [c.name, Array.from(c.y)])"
    choose(driver, "component", 1)
    (name, whole), *parts = driver.execute_script(curves)
    assert name == "all together"
    np.testing.assert_array_equal(whole, result["acc/joints/joint2"])
    choose(driver, "point", 1)
    options = driver.execute_script(
        "return [...document.getElementById('component').options].map((o) => o.textContent)"
    )
    assert options == ["turning about z", "x", "y"]
    (_, whole), *parts = driver.execute_script(curves)
    np.testing.assert_array_equal(whole, result["acc/link3,0.25,0,0/x"])
    assert [part for part, _ in parts] == [
        *(f"torque of joint{i}" for i in (1, 2, 3)), "gravity", "velocities", "load pull"
    ]  # fmt: skip
    np.testing.assert_allclose(np.sum([y for _, y in parts], axis=0), whole, atol=1e-10 * np.abs(whole).max())
    cursor = "return document.getElementById('sourced-cursor').style.left"
    before = driver.execute_script(cursor)
    choose(driver, "slider", 10)
    assert driver.execute_script(cursor) != before
    assert driver.get_log("browser") == []


POWER = "return document.getElementById('power').data[0]"


def test_energy_flows_from_joints_through_links_and_balances(page, result):
    choose(page, "span", "movement")
    flows = page.execute_script(POWER)
    assert flows["type"] == "sankey"
    record = json.loads((result / "analysis.json").read_text(encoding="utf-8"))["work"]["into_links"]
    net = {(entry["joint"], entry["link"]): entry["net"] for entry in record}
    for link in ("link1", "link2", "link3"):
        net["links", link] = -sum(x for (_, through), x in net.items() if through == link)
    least = 0.005 * max(map(abs, net.values()))
    expected = {pair: pytest.approx(x, rel=1e-9) for pair, x in net.items() if abs(x) > least}
    assert {x > 0 for x in net.values()} == {True, False}
    seen = {}
    for (start, end), value in zip(flows["link"]["customdata"], flows["link"]["value"], strict=True):
        gives = end in ("link1", "link2", "link3")
        seen[(start.split()[0], end) if gives else (end.split()[0], start)] = value if gives else -value
    assert seen == expected


def test_power_now_is_the_files(page, result):
    table = pq.read_table(result / "analysis.parquet")
    choose(page, "span", "now")
    for at in (321, 700):
        choose(page, "slider", at)
        numbers = page.execute_script(POWER)["z"]
        for i in range(3):
            for j in range(3):
                name = f"power/joint{i + 1}/link{j + 1}"
                written = table[name][2 * at].as_py() if name in table.column_names else None
                assert numbers[i][j] == written
            assert numbers[i][3] == pytest.approx(table[f"power/joint{i + 1}"][2 * at].as_py(), rel=1e-9)
        gains = [sum(row[j] or 0 for row in numbers[:3]) for j in range(3)]
        assert numbers[3] == pytest.approx([*gains, sum(gains)], rel=1e-9)


def test_curves_are_linked_to_the_slider(page):
    choose(page, "slider", 700)
    share = page.execute_script(
        "const area = document.querySelector('#curves .nsewdrag').getBoundingClientRect();"
        "const line = document.getElementById('curves-cursor').getBoundingClientRect();"
        "return (line.left + line.width / 2 - area.left) / area.width"
    )
    assert share == pytest.approx(700 / 999, abs=2e-3)
    for end in (0, 999):
        choose(page, "slider", end)
        assert page.find_element("id", "curves-cursor").is_displayed()
    page.execute_script("document.getElementById('map').emit('plotly_click', {points: [{x: 2, y: 1}]})")
    assert page.find_element("id", "joint").get_attribute("value") == "1"
    assert page.find_element("id", "curves-title").text == "On joint2, through all links, by cause"
    page.execute_script("document.getElementById('curves').emit('plotly_click', {points: [{x: 3.313}]})")
    assert page.find_element("id", "slider").get_attribute("value") == "166"


def test_keyboard(page):
    body = page.find_element("tag name", "body")
    slider = page.find_element("id", "slider")
    body.send_keys("\ue011")  # Home
    body.send_keys("\ue014")  # right
    assert slider.get_attribute("value") == "1"
    body.send_keys("\ue008\ue014")  # with Shift by ten
    assert slider.get_attribute("value") == "11"
    body.send_keys("\ue010")  # End
    assert slider.get_attribute("value") == "999"
    pressed = monotonic()
    body.send_keys(" ")  # from the end it plays from the start
    play = page.find_element("id", "play")
    assert play.get_attribute("aria-pressed") == "true"
    page.execute_async_script("setTimeout(arguments[0], 400)")
    body.send_keys(" ")
    assert play.get_attribute("aria-pressed") == "false"
    assert 1 < int(slider.get_attribute("value")) < 50 * (monotonic() - pressed) + 2  # as time goes


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_phone_width_and_colour_scheme(page, scheme):
    feature = {"name": "prefers-color-scheme", "value": scheme}
    page.execute_cdp_cmd("Emulation.setEmulatedMedia", {"features": [feature]})
    size = {"width": 390, "height": 844, "deviceScaleFactor": 2, "mobile": True}
    page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    page.refresh()
    widths = "return [document.documentElement.scrollWidth, document.getElementById('map').clientWidth]"
    full, plot = page.execute_script(widths)
    assert full == 390
    assert 300 < plot < 390
    ink = page.execute_script("return getComputedStyle(document.body).color")
    assert (sum(map(int, ink[4:-1].split(","))) > 400) == (scheme == "dark")
    page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_downloads(page, result, tmp_path):
    page.execute_cdp_cmd("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(tmp_path)})
    for button in ("save-curves-csv", "save-map-png"):
        page.execute_script("document.getElementById(arguments[0]).click()", button)
    page.execute_async_script("setTimeout(arguments[0], 1500)")
    written = {file.suffix: file for file in tmp_path.iterdir()}
    assert written[".png"].read_bytes()[:4] == b"\x89PNG"
    saved = np.genfromtxt(written[".csv"], delimiter=",", skip_header=1)
    table = pq.read_table(result / "analysis.parquet")
    np.testing.assert_array_equal(saved[:, 0], table["time"].to_numpy()[::2])
    record = json.loads((result / "analysis.json").read_text(encoding="utf-8"))
    assert record["samples"] == 2 * len(saved)


def crowd(place, count=14):
    """A page of as many joints, one with a name of 80 letters, where k loads i through link k."""
    place.mkdir()
    analysis = analyze(write_csv(place / "a.csv", smooth(40, 3)), PLANAR3)
    names = tuple(
        f"spine_joint_{i}" if i != 4 else f"{'name_from_a_drawing_' * 4}"[:79] + "4" for i in range(14)
    )
    robot = replace(analysis.robot, joints=names, links=names, units=("rad",) * count, tree=None)
    pairs = [(i, k) for i in range(count) for k in range(count)]
    places = [
        ("time", ()),
        *(("tau_qdd", (i, k, k)) for i, k in pairs),
        *(("power_link", at) for at in pairs),
    ]
    torques = np.sin(np.arange(count * count)[:, None] + np.arange(40) / 9)
    values = np.vstack([analysis.values[0], torques, torques])
    totals = Totals(
        np.abs(values).mean(axis=1), np.abs(values).max(axis=1), np.sqrt((values**2).mean(axis=1))
    )
    given = np.arange(1.0, count * count + 1).reshape(count, count)
    works = {**analysis.works, "power_link": Work(given, given.T)}
    rows = ResultRows.of(robot, places)
    made = replace(analysis, robot=robot, rows=rows, values=values, totals=totals, works=works)
    (place / "report.html").write_text(report(made), encoding="utf-8")
    return names, (place / "report.html").as_uri()


BESIDE = (
    "document.getElementById('map-frame').scrollLeft = 100;"
    "return [...document.querySelectorAll('#map-rows:not([hidden]) div')]"
    ".map((row) => [row.textContent, row.getBoundingClientRect()])"
    ".map(([text, box]) => [text, box.top, box.bottom])"
)
TICKS = (
    "return [...document.querySelectorAll('#' + (arguments[1] || 'map') + ' .' + arguments[0] + ' text')]"
    ".map((text) => [text.textContent, text.getBoundingClientRect()])"
    ".map(([text, box]) => [text, box.left, box.right, box.top, box.bottom])"
)


@pytest.mark.parametrize("width", [390, 1280])
def test_many_joints_and_long_names_fit(driver, tmp_path, width):
    names, address = crowd(tmp_path / "page")
    size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 500}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    opened(driver, address)
    full, plot, area = driver.execute_script(
        "return [document.documentElement.scrollWidth, document.getElementById('map').clientWidth,"
        "document.querySelector('#map .nsewdrag').getBoundingClientRect().width]"
    )
    assert full <= width
    assert area > 0.5 * plot
    columns = driver.execute_script(TICKS, "xtick")
    assert [text for text, *_ in columns][:2] == ["spine_joint_0", "spine_joint_1"]
    assert len(columns) == 14
    for (_, _, right, _, _), (_, left, _, _, _) in pairwise(columns):
        assert right <= left + 1
    rows = driver.execute_script(TICKS, "ytick")
    assert len(rows) == 14
    assert "…" in rows[4][0]
    for (_, _, _, _, bottom), (_, _, _, top, _) in pairwise(sorted(rows, key=lambda row: row[3])):
        assert bottom <= top + 1
    beside = driver.execute_script(BESIDE)
    assert bool(beside) == (width < 500)  # where the map is scrolled its rows keep their names
    for (name, top, bottom), (text, _, _, high, low) in zip(beside, rows, strict=False):
        assert name == text
        assert top <= high < low <= bottom
    assert driver.execute_script(POWER)["type"] == "heatmap"  # 182 flows are too many to follow
    for (_, _, right, _, _), (_, left, _, _, _) in pairwise(driver.execute_script(TICKS, "xtick", "power")):
        assert right <= left + 1
    assert [text for text, *_ in driver.execute_script(TICKS, "ytick", "power")][-1] == "link gains"
    hover, colours = driver.execute_script(
        "return [document.getElementById('map').data[0].customdata[4][4],"
        "document.getElementById('curves').data.map((trace) => trace.line.color)]"
    )
    assert hover[:2] == [names[4], f"{names[4]} motion"]
    assert len(set(colours)) == 7  # six motions and what others make
    assert driver.get_log("browser") == []
    driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def hovered(driver, before):
    """Return what the shares' label says; nothing while it says what it said before, for Plotly waits a
    little."""
    said = driver.execute_script(
        "return [...document.querySelectorAll('#shares .hovertext')].map((text) => text.textContent)"
    )
    return said if said != before[-1:] else []


def test_contacts_are_arrows_and_feed_links_as_they_slip(driver, tmp_path):
    write_package(generate(read_system(LEG), ["numpy"]), tmp_path / "leg")
    robot = load_robot(tmp_path / "leg")
    log = write_csv(tmp_path / "a.csv", smooth(80, 6) * 0.4, robot.joints)
    contacts, out = Contacts((Contact("foot", name="sole"),)), tmp_path / "out"
    result, _ = analyze_to(out, log, robot, Request(contacts=contacts), silent)
    opened(driver, (out / "report.html").as_uri())
    busiest = int(np.abs(result.torque).mean(axis=0).argmax())
    assert driver.find_element("id", "joint").get_attribute("value") == str(busiest)
    assert busiest >= 3  # the base has no torques
    titles = "return [...document.querySelectorAll('#stick .load title')].map((title) => title.textContent)"
    assert driver.execute_script(titles) == ["ground at sole"]
    choose(driver, "span", "now")
    choose(driver, "slider", 40)
    rows = driver.execute_script("return document.getElementById('power').data[0].z")
    fed = [values[40] for c, values in zip(result.columns, result.values, strict=True) if feeds(c)]
    assert rows[6][:4] == pytest.approx(fed)
    assert driver.get_log("browser") == []


def feeds(column: Column) -> bool:
    return column.quantity == "power_contact"


def test_loads_are_causes_and_arrows(driver, tmp_path):
    log = write_csv(tmp_path / "a.csv", smooth(200, 3))
    time = np.arange(250) / 100
    push = np.column_stack([5 * np.sin(time), 3 * np.cos(time), 0 * time])
    loads = Loads(
        (Load("hand", "link3", push, point=(0.25, 0, 0), time=time), Load("rope", "link2", (0, 9, 0)))
    )
    write_package(generate(read_system("planar3"), ["numpy"]), tmp_path / "planar3")
    robot = with_payloads(load_robot(tmp_path / "planar3"), (Payload("link3", 0.5, (0.25, 0, 0)),))
    out = tmp_path / "out"
    result, _ = analyze_to(out, log, robot, Request(loads=loads), silent)
    opened(driver, (out / "report.html").as_uri())
    choose(driver, "slider", 40)
    assert driver.execute_script("return document.getElementById('order').value") == "everything"
    for motion, names in (("apart", [*robot.joints] * 2), ("together", [*robot.joints])):
        choose(driver, "motion", motion)
        columns = driver.execute_script(TICKS, "xtick")
        assert [text for text, *_ in columns] == ["gravity", "load hand", "load rope", *names]
        sums = [sum(x or 0 for x in row) for row in shown_map(driver)[1]]
        assert sums == pytest.approx(result.torque[40].tolist(), rel=1e-12)
    for caption in ("map-caption", "curves-caption", "shares-caption", "numbers-caption"):
        assert "Gravity and loads are in." in driver.find_element("id", caption).text
    choose(driver, "order", "movement")
    assert "Left out: gravity, load hand, load rope" in driver.find_element("id", "shares-caption").text
    choose(driver, "order", "tau_load")
    _, numbers = shown_map(driver)
    for i in range(3):
        assert [x or 0 for x in numbers[i]] == pytest.approx(result.load_torque[40, i].tolist(), rel=1e-13)
    assert numbers[2][1] is None  # joint 3 does not move link 2
    arrows = driver.execute_script(
        "return [...document.querySelectorAll('#stick g.load line')]"
        ".map((line) => ['x1', 'y1', 'x2', 'y2'].map((at) => Number(line.getAttribute(at))))"
    )
    assert (
        "Arrows are forces from outside; the longest is 9 N."
        in driver.find_element("id", "figure-caption").text
    )
    directions = [np.subtract(ends[2:], ends[:2]) for ends in arrows]
    for direction, force in zip(directions, (push[40, :2], (0, 9)), strict=True):
        along = direction * [1, -1] / np.hypot(*direction)
        np.testing.assert_allclose(along, force / np.hypot(*force), atol=1e-6)
    choose(driver, "order", "everything")
    cells = driver.execute_script(
        "return [...document.querySelectorAll('#numbers td[data-value]')]"
        ".map((td) => Number(td.dataset.value))"
    )
    assert sum(cells[:-1]) == pytest.approx(cells[-1], rel=1e-12)
    assert cells[-1] == result.torque[40, 0]
    choose(driver, "span", "now")
    power = driver.execute_script("return document.getElementById('power').data[0].z")
    into = [[*result.power[40, i], *(result.load_torque[40, i] * result.qd[40, i])] for i in range(3)]
    assert [[x or 0 for x in row[:6]] for row in power[:3]] == [pytest.approx(row, rel=1e-12) for row in into]
    assert driver.get_log("browser") == []


def test_a_bone_leads_past_joints_that_carry_no_link_to_the_next_link(driver, tmp_path):
    """A knee that slides on the thigh as it bends, whose slide weighs nothing, parts no leg."""
    slide = urdf_text.joint("slide", "thigh", "between", type="prismatic", xyz="0 0 0")
    knee = urdf_text.joint("knee", "between", "shank", xyz="0 0 -0.4")
    hip = urdf_text.joint("hip", "pelvis", "thigh")
    links = [*map(urdf_text.link, ("pelvis", "thigh", "shank")), '<link name="between"/>']
    (tmp_path / "leg.urdf").write_text(urdf_text.robot(*links, hip, slide, knee))
    write_package(generate(read_system(tmp_path / "leg.urdf"), ["numpy"]), tmp_path / "leg")
    names = load_robot(tmp_path / "leg").joints
    analysis = analyze(write_csv(tmp_path / "a.csv", smooth(60, 3), names), tmp_path / "leg")
    (tmp_path / "report.html").write_text(report(analysis), encoding="utf-8")
    opened(driver, (tmp_path / "report.html").as_uri())
    choose(driver, "slider", 30)
    dots, bones, dotted = driver.execute_script(
        "const numbers = (names) => (one) => names.map((name) => Number(one.getAttribute(name)));"
        "const all = (what) => [...document.querySelectorAll(`#stick ${what}`)];"
        "return [all('circle').map(numbers(['cx', 'cy'])),"
        " all('line[stroke-width=\"10\"]').map(numbers(['x1', 'y1', 'x2', 'y2'])),"
        " all('line[stroke-dasharray=\"2 5\"]').length]"
    )
    thigh, shank = bones
    assert thigh[2:] == shank[:2]
    assert {tuple(thigh[:2]), tuple(shank[:2])} <= set(map(tuple, dots))
    assert dotted == 1  # from the ground to the hip


def test_a_robot_that_moves_in_a_plane_is_seen_from_its_side(driver, tmp_path):
    """A leg beside another, as walking is looked at; it may be turned all the same."""
    aside = {"rpy": "0 0 0", "axis": "0 1 0"}
    legs = [
        urdf_text.joint(f"hip{y}", "a", leg, xyz=f"0 {y} 0", **aside) for y, leg in ((0.2, "b"), (-0.2, "c"))
    ]
    (tmp_path / "legs.urdf").write_text(urdf_text.robot(*map(urdf_text.link, "abc"), *legs))
    write_package(generate(read_system(tmp_path / "legs.urdf"), ["numpy"]), tmp_path / "legs")
    names = load_robot(tmp_path / "legs").joints
    log = write_csv(tmp_path / "a.csv", smooth(60, 2), names)
    analysis = analyze(log, tmp_path / "legs")
    (tmp_path / "report.html").write_text(report(analysis), encoding="utf-8")
    opened(driver, (tmp_path / "report.html").as_uri())
    assert "Drag to turn" in driver.find_element("id", "figure-caption").text
    origins, centres = stick_figure(analysis.robot, analysis.q)
    choose(driver, "slider", 30)
    dots = driver.execute_script(
        "return [...document.querySelectorAll('#stick circle')]"
        ".map((dot) => ['cx', 'cy'].map((at) => Number(dot.getAttribute(at))))"
    )
    seen = np.array(dots) * [1, -1]
    world = np.stack([origins[30], centres[30]], axis=1).reshape(-1, 3)[:, [0, 2]]
    assert len(seen) == len(world) == 4
    scale = np.ptp(seen[:, 1]) / np.ptp(world[:, 1])
    np.testing.assert_allclose(seen - seen[0], scale * (world - world[0]), atol=0.02)


def test_names_are_shown_and_not_obeyed(driver, tmp_path):
    names = ("%{x} %{customdata}", "</script><script>document.title=1</script>", "<b>$x^\n\u202e&lt;")
    analysis = analyze(write_csv(tmp_path / "a.csv", smooth(40, 3)), PLANAR3)
    robot = replace(analysis.robot, name=names[1], joints=names, links=names)
    rows = ResultRows.of(robot, torque_places(robot, term_rows(robot.model.layout)))
    made = replace(analysis, robot=robot, rows=rows, source=names[2])
    (tmp_path / "report.html").write_text(report(made), encoding="utf-8")
    opened(driver, (tmp_path / "report.html").as_uri())
    shown = [*names[:2], "<b>$x^\\n\\u202e&lt;"]
    assert driver.title == f"{shown[1]} · {shown[2]}"
    options = "return [...document.querySelectorAll('#joint option')].map((option) => option.title)"
    assert driver.execute_script(options) == shown
    rows = [text for text, *_ in driver.execute_script(TICKS, "ytick")]
    assert [rows[0], rows[2]] == [shown[0], shown[2]]
    flows = driver.execute_script(
        "return [...document.querySelectorAll('#power .node-label')].map((text) => text.textContent)"
    )
    assert any(text.startswith(names[0]) for text in flows)
    assert "</script><scr" in " ".join(flows)
    told = []
    choose(driver, "order", "tau_qdd")
    for curve in range(2):
        driver.execute_script(
            "Plotly.Fx.hover('shares', [{curveNumber: arguments[0], pointNumber: 0}])", curve
        )
        told += WebDriverWait(driver, 10).until(partial(hovered, before=told))
    assert [text.partition("% of ")[2] for text in told] == [
        f"{shown[0]}, {name} acceleration" for name in shown[:2]
    ]
    assert driver.get_log("browser") == []


def test_a_browser_that_cannot_unpack_says_which_can(driver, result):
    hidden = driver.execute_cdp_cmd(
        "Page.addScriptToEvaluateOnNewDocument", {"source": "delete window.DecompressionStream"}
    )
    driver.get((result / "report.html").as_uri())
    driver.execute_cdp_cmd("Page.removeScriptToEvaluateOnNewDocument", hidden)
    assert "Chrome or Edge 80, Firefox 113, Safari 16.4" in driver.find_element("id", "waiting").text
    assert not driver.find_element("tag name", "main").is_displayed()
    assert driver.get_log("browser") == []


def test_signs_are_no_matter_where_nothing_is_uncertain(driver, tmp_path):
    """Motion of one arm loads no joint of the other, and has no sign there."""
    system = read_system("torso")
    write_package(generate(system, ["numpy"]), tmp_path / "torso")
    names = [coordinate.name for coordinate in system.coordinates]
    log = write_csv(tmp_path / "a.csv", smooth(40, len(names)), names)
    (tmp_path / "report.html").write_text(report(analyze(log, tmp_path / "torso")), encoding="utf-8")
    opened(driver, (tmp_path / "report.html").as_uri())
    said = "return JSON.stringify(document.getElementById('shares').data.map((trace) => trace.customdata))"
    assert "motion" in driver.execute_script(said)
    assert "no certain sign" not in driver.execute_script(said)
    bars = driver.execute_script("return document.getElementById('shares').data.map((trace) => trace.y)")
    assert list(range(len(names))) in bars, "a row for each joint"


def test_deviations_are_bands_numbers_hatches_and_a_list(driver, tmp_path):
    (tmp_path / "bodies.toml").write_text(
        'schema = 1\n[all]\nmass = "10 %"\ncentre = "60 mm"\nradii = "20 %"\n'
    )
    log = write_csv(tmp_path / "a.csv", smooth(200, 3))
    result = analyze(log, PLANAR3, uncertain=tmp_path / "bodies.toml")
    (tmp_path / "report.html").write_text(report(result), encoding="utf-8")
    opened(driver, (tmp_path / "report.html").as_uri())
    choose(driver, "motion", "apart")
    choose(driver, "joint", 0)
    choose(driver, "link", 2)
    bands = driver.execute_script(
        "return document.getElementById('curves').data.filter((trace) => trace.meta === 'band')"
        ".map((trace) => [trace.legendgroup, [...trace.y]])"
    )
    edges = dict(bands)
    assert len(edges) == len(bands) == 8  # all causes, gravity, and two of each joint
    low, high = np.reshape(edges["tau_qd 2"], (2, -1))
    value, spread = result["tau_qd/joint1/link3/joint3"], result["sd/tau_qd/joint1/link3/joint3"]
    np.testing.assert_allclose([low, high[::-1]], [value - spread, value + spread], rtol=1e-12)
    choose(driver, "slider", 50)
    cells = driver.execute_script(
        "return [...document.querySelectorAll('#numbers td[data-value]')].map((td) =>"
        "[JSON.parse(td.dataset.columns)[0], td.textContent])"
    )
    column = "tau_gravity/joint1/link3"
    assert dict(cells)[column] == plus_minus(result[column][50], result[f"sd/{column}"][50])
    choose(driver, "link", "")
    choose(driver, "joint", 1)
    of_sums = driver.execute_script(
        "return [...document.querySelectorAll('#numbers td[data-value]')].map((td) =>"
        "[JSON.parse(td.dataset.columns).length, td.textContent.includes('± ≤')])"
    )
    assert {1, 2} <= {count for count, _ in of_sums}
    assert all(is_most == (count > 1) for count, is_most in of_sums), "deviations of sums are bounds"
    choose(driver, "joint", 0)
    choose(driver, "link", 2)
    open_now = [
        abs(result[name][50]) < 2 * result[f"sd/{name}"][50]
        for name in (f"tau_qdd/joint1/link3/joint{k}" for k in (1, 2, 3))
    ]
    texts = driver.execute_script("return document.getElementById('map').data[0].text[0]")
    assert [text.endswith("?") for text in texts[1:4]] == open_now
    signs = result.signs
    assert driver.find_element("id", "certain-sentence").text == signs.sentence
    assert (
        f"{len(signs.uncertain)} of {len(signs.shares)} shares"
        in driver.find_element("id", "certain-caption").text
    )
    more = driver.find_element("id", "every-unsure")
    more.send_keys("\n")  # by keyboard
    listed = driver.execute_script(
        "return [...document.querySelectorAll('#unsure tbody tr')].map((row) => row.cells[3].textContent)"
    )
    assert listed == [f"{plus_minus(p.value, p.deviation)} {p.column.unit}" for p in signs.uncertain]
    hatched = driver.execute_script(
        "return document.getElementById('shares').data.filter((trace) => trace.marker.pattern"
        " && trace.marker.pattern.size === 4).map((trace) => trace.name)"
    )
    # A share is of a motion, whose deviation is at most that of both its parts together.
    moved, spread = (
        result.dense(f"{of}tau_qdd")[:, :, 2] + result.dense(f"{of}tau_qd")[:, :, 2] for of in ("", "sd/")
    )
    most = np.abs(moved).argmax(axis=0)[None]
    peaks, doubts = (np.take_along_axis(np.abs(one), most, axis=0)[0] for one in (moved, spread))
    open_there = (peaks < 2 * doubts) & (peaks + 2 * doubts > 1e-3 * peaks.max(axis=1, keepdims=True))
    assert 0 < open_there.sum() < open_there.size
    assert set(hatched) == {f"joint{k + 1} motion" for k in np.flatnonzero(open_there.any(axis=0))}
    assert "Masses: ± 10 %." in driver.find_element("id", "assumed").text
    assert driver.get_log("browser") == []
