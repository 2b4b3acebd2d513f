"""The study's page in a real browser: its numbers are the tables', and it leads to each trial."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.studies import CHOICES, CYCLES, HEAD, QUICK, TRIALS, Here, write_study
from linkwise.study import run_study
from linkwise.study.comparisons import Cluster, compared
from selenium.webdriver.support.wait import WebDriverWait

pd = pytest.importorskip("pandas")
pytestmark = pytest.mark.browser
COMPARE = '\n[[compare]]\nfactor = "condition"\nbetween = ["slow", "fast"]\ncolumns = ["tau/*"]\n'
DAYS = '\n[[compare]]\nfactor = "day"\nbetween = ["2", "1"]\ncolumns = ["tau/joint2"]\n'
TWO_FACTORS = HEAD.replace('["condition"]', '["condition", "day"]')
BY_DAY = TRIALS.replace("{trial}", "{day}")
LOWEST = {"deviation": lambda c: c.mean() - c.std(), "range": lambda c: c.min()}
HIGHEST = {"deviation": lambda c: c.mean() + c.std(), "range": lambda c: c.max()}
CURVES = "return document.getElementById('bands').data.map(({name, y}) => [name, Array.from(y)])"


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of three subjects whose last log is broken, so that one was slow on one day alone."""
    folder = tmp_path_factory.mktemp("page")
    parts = TWO_FACTORS, CHOICES, CYCLES, COMPARE, DAYS, BY_DAY
    file = write_study(folder, *parts, subjects=3, trials=2)
    (folder / "data/S3/slow_2.csv").write_text("time,joint1\n0,1\n")
    found = run_study(file, folder / "out", Here())
    assert [one.name for one in found.broken] == ["S3-slow-2"]
    return folder / "out"


def opened(driver: Any, address: str) -> None:
    """Open a page and wait until it is unpacked and drawn."""
    driver.get(address)
    WebDriverWait(driver, 20).until(
        lambda driver: driver.execute_script("return 'drawn' in document.documentElement.dataset")
    )


@pytest.fixture
def page(driver: Any, out: Path) -> Any:
    opened(driver, (out / "study.html").as_uri())
    yield driver
    assert driver.get_log("browser") == []


def choose(page: Any, name: str, value: object) -> None:
    page.execute_script(
        "const e = document.getElementById(arguments[0]); e.value = arguments[1];"
        "e.dispatchEvent(new Event('change', {bubbles: true}));",
        name,
        str(value),
    )


def of_subjects(out: Path, factor: str | None, column: str) -> dict[str, Any]:
    """Return by level the mean curve of each subject (subjects, points) over all its trials there."""
    table = pd.read_parquet(out / "trials")
    table["level"] = table[factor].astype(str) if factor else "all subjects"
    trials = table.groupby(["level", "subject", "trial", "percent"], observed=True)[column].mean()
    each = trials.groupby(["level", "subject", "percent"], observed=True).mean().unstack("percent")
    return {level: each.loc[level] for level in each.index.unique("level")}


def test_nothing_is_hatched_without_what_is_uncertain(page: Any) -> None:
    assert not page.find_element("id", "hatched").is_displayed()


def test_it_opens_with_the_column_that_it_says(page: Any) -> None:
    chosen = "return document.getElementById('column').selectedOptions[0].text"
    assert page.execute_script(chosen) == page.find_element("id", "bands-title").text != ""
    choose(page, "column", 1)
    assert page.execute_script(chosen) == page.find_element("id", "bands-title").text == "tau/joint2"


@pytest.mark.parametrize("factor", ["condition", "day", None])
def test_its_curves_and_bands_are_those_of_the_chosen_factors_subjects(
    page: Any, out: Path, factor: str | None
) -> None:
    column = "tau/joint2"
    choose(page, "column", 1)
    choose(page, "factor", ["", "condition", "day"].index(factor or ""))
    each = of_subjects(out, factor, column)
    order = {"condition": ["fast", "slow"], "day": ["1", "2"]}.get(factor or "", ["all subjects"])
    for band in ("deviation", "range", "subjects"):
        choose(page, "band", band)
        expected: list[Any] = []
        for level, subjects in ((level, each[level]) for level in order):
            if band == "subjects":
                expected += [(name, curve) for name, curve in subjects.iterrows()]
            else:
                expected += [(None, LOWEST[band](subjects)), (None, HIGHEST[band](subjects))]
            expected.append((level, subjects.mean()))
        shown = page.execute_script(CURVES)
        assert [name for name, _ in shown if name] == [name for name, _ in expected if name]
        scale = max(np.abs(curve).max() for _, curve in expected)
        for (_, found), (name, curve) in zip(shown, expected, strict=True):
            np.testing.assert_allclose(found, curve, rtol=0, atol=1e-6 * scale, err_msg=f"{band} {name}")
    layout = "const {layout} = document.getElementById('bands'); return "
    assert page.execute_script(layout + "layout.yaxis.title.text") == "N·m"
    x = page.execute_script("return document.getElementById('bands').data.map(({x}) => Array.from(x))")
    np.testing.assert_allclose(x, [np.linspace(0, 100, 101)] * len(x))
    tests = pd.read_parquet(out / "tests.parquet")
    differ = tests[(tests.column == column) & (tests.factor == (factor or "subject"))].dropna(subset="start")
    bars = page.execute_script(layout + "layout.shapes.map(({x0, x1}) => [x0, x1])")
    np.testing.assert_allclose(np.reshape(bars, (-1, 2)), differ[["start", "end"]])
    assert len(bars) > 0 or factor != "condition"
    trials = {"condition": (6, 5), "day": (6, 5), None: (11,)}[factor]
    caption = page.find_element("id", "bands-caption").text
    for level, count in zip(order, trials, strict=True):
        assert f"{level}: 3 subjects, {count} trials" in caption
    assert ("a bar stands on the axis" in caption) == (factor is not None)


def test_trials_without_cycles_are_dots_with_deviations(driver: Any, tmp_path: Path) -> None:
    lacks = TRIALS.replace("{condition}_{trial}", "slow_1").replace("-{condition}-{trial}", "-else")
    lacks += 'condition = "else"\npayload = ["p:link3=1"]\n'
    columns = "pages = false\n"
    file = write_study(tmp_path, HEAD, columns, CHOICES, COMPARE, TRIALS, lacks, subjects=3, trials=1)
    run_study(file, tmp_path / "out", Here())
    opened(driver, (tmp_path / "out/study.html").as_uri())
    names = "return [...document.getElementById('column').options].map((option) => option.textContent)"
    every = driver.execute_script(names)
    column = every.index("tau/joint1/p")
    unit = "return document.getElementById('bands').layout.yaxis.title.text"
    for name, expected in (("q/joint1", "rad"), ("tau/joint1", "N·m")):
        choose(driver, "column", every.index(name))
        assert driver.execute_script(unit) == expected
    rows = pd.read_parquet(tmp_path / "out/summary.parquet").set_index("column")
    dots = (
        "return document.getElementById('bands').data"
        ".map((dot) => [dot.name, dot.y[0], dot.error_y.array[0]])"
    )
    for at, name, levels in (
        (0, "tau/joint1", ("fast", "slow", "else")),
        (column, "tau/joint1/p", ("else",)),
    ):
        choose(driver, "column", at)
        means = [rows.loc[[name]].query("condition == @level")["mean"] for level in levels]
        shown = driver.execute_script(dots)
        assert [dot[0] for dot in shown] == list(levels)
        expected = [[each.mean(), each.std()] for each in means]
        np.testing.assert_allclose([dot[1:] for dot in shown], expected, rtol=1e-5)


def test_integrals_over_cycles_are_dots_beside_curves(page: Any, out: Path) -> None:
    names = "return [...document.getElementById('column').options].map((option) => option.textContent)"
    choose(page, "factor", 1)
    choose(page, "column", page.execute_script(names).index("integral/power/joint1"))
    shown = page.execute_script(
        "return document.getElementById('bands').data"
        ".map((dot) => [dot.name, dot.mode, Array.from(dot.y), dot.error_y.array[0]])"
    )
    rows = pd.read_parquet(out / "summary.parquet").query("column == 'integral/power/joint1'")
    each = rows.groupby(["condition", "subject"])["mean"].mean()
    for (level, mode, values, deviation), expected in zip(shown, ("fast", "slow"), strict=True):
        assert (level, mode) == (expected, "markers")
        assert [*values, deviation] == pytest.approx([each[level].mean(), each[level].std()], rel=1e-5)
    assert "Means over cycles" in page.find_element("id", "bands-caption").text
    choose(page, "column", 1)
    assert {len(y) for _, y in page.execute_script(CURVES)} == {101}


def test_it_leads_to_each_trial_and_tells_the_broken_one(page: Any) -> None:
    table = page.find_element("id", "trials")
    rows = [row.text for row in table.find_elements("css selector", "tbody tr")]
    assert len(rows) == 12
    assert rows[0] == "S1-fast-1 S1 fast 1 300 samples, 3 cycles"
    assert rows[-1].startswith("S3-slow-2 S3 slow 2")
    assert "no column for joint" in rows[-1]
    tests = [row.text for row in page.find_elements("css selector", "#tests tbody tr")]
    assert tests[0].startswith("tau/joint1 condition: slow – fast 3, paired ")
    assert tests[-1].startswith("tau/joint2 day: 2 – 1 3, paired ")
    link = table.find_element("link text", "S2-fast-1")
    opened(page, link.get_attribute("href"))
    assert page.title == "planar3 · fast_1.csv"


def test_a_trial_is_drawn_over_the_bands_until_it_is_clicked_again(page: Any, out: Path) -> None:
    choose(page, "column", 2)
    before = len(page.execute_script(CURVES))
    page.find_element("css selector", "#trials tbody tr:nth-child(3) td:last-child").click()
    shown = page.execute_script(CURVES)
    assert (len(shown), shown[-1][0]) == (before + 1, "S1-slow-1")
    table = pd.read_parquet(out / "trials").query("trial == 'S1-slow-1'")
    np.testing.assert_allclose(
        shown[-1][1], table.groupby("percent", observed=True)["tau/joint3"].mean(), rtol=1e-5, atol=1e-6
    )
    page.find_element("css selector", "#trials tbody tr:nth-child(3) td:last-child").click()
    assert len(page.execute_script(CURVES)) == before


@pytest.mark.parametrize(
    ("alpha", "p", "said"),
    [
        (0.05, 0.04996, "p = 0.04996"),
        (0.05, 0.0497, "p = 0.0497"),
        (0.05, 0.0004, "p < 0.001"),
        (0.0005, 0.0004, "p < 0.0005"),
    ],
)
def test_numbers_have_the_digits_by_which_they_differ(
    driver: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, alpha: float, p: float, said: str
) -> None:
    part = Cluster(36.97, 37.01, p)

    def of_that_part(*given: Any) -> Any:
        tests, told = compared(*given)
        return [replace(test, clusters=(part,)) for test in tests], told

    monkeypatch.setattr("linkwise.study.results.compared", of_that_part)
    compare = f"{COMPARE}alpha = {alpha}\n"
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, CYCLES, compare, TRIALS, subjects=3, trials=1)
    run_study(file, tmp_path / "out", Here())
    opened(driver, (tmp_path / "out/study.html").as_uri())
    shown = driver.find_element("id", "tests").text.replace("\u00a0", " ")
    assert f"36.97–37.01 % ({said})" in shown


@pytest.fixture(scope="module")
def uncertain(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of uncertain bodies."""
    folder: Path = tmp_path_factory.mktemp("uncertain")
    choices = CHOICES + 'uncertain = "bodies.toml"\n'
    kept = QUICK.replace("tau/*", "tau/**")
    file = write_study(folder, HEAD, kept, choices, CYCLES, TRIALS, subjects=3, trials=2)
    (folder / "bodies.toml").write_text('schema = 1\n[all]\nmass = "10 %"\ncentre = "20 mm"\n')
    run_study(file, folder / "out", Here())
    return folder / "out"


def test_what_is_uncertain_is_hatched_apart_from_the_spread(driver: Any, uncertain: Path) -> None:
    opened(driver, (uncertain / "study.html").as_uri())
    every = "return [...document.getElementById('column').options].map((option) => option.textContent)"
    names = driver.execute_script(every)
    assert not [name for name in names if name.startswith("sd")]
    table = pd.read_parquet(uncertain / "curves.parquet").set_index(["condition", "column"])
    bands = (
        "return document.getElementById('bands').data.filter((one) => one.x.length > 1)"
        ".map((one) => [one.fillpattern?.shape ?? '', Array.from(one.y)])"
    )
    legend = "return document.getElementById('bands').data.map((one) => one.name).filter(Boolean)"
    for column in ("tau/joint2", "tau/joint1/link3"):
        choose(driver, "column", names.index(column))
        for hatched, said in (
            ("within", "within a trial"),
            ("mean", "of the mean"),
            ("new", "of a new subject"),
        ):
            choose(driver, "hatched", hatched)
            shown = driver.execute_script(bands)
            for at, condition in enumerate(("fast", "slow")):
                rows = table.loc[(condition, column)]
                (_, _), (filled, most), (_, low), (pattern, high), (_, mean) = shown[5 * at : 5 * at + 5]
                assert (filled, pattern) == ("", "/\\"[at])
                scale = 1e-6 * np.abs(rows["max"]).max()
                np.testing.assert_allclose(most, rows["mean"] + rows["std"], atol=scale)
                for edge, side in ((low, -1), (high, 1)):
                    expected = rows["mean"] + side * rows[f"sd_{hatched}"]
                    np.testing.assert_allclose(edge, expected, atol=scale)
                np.testing.assert_allclose(mean, rows["mean"], atol=scale)
            told = driver.execute_script(legend)
            assert told[2] == "filled: ± sd between subjects"
            assert said in told[3]
            alike = "the same in all trials" in driver.find_element("id", "bands-caption").text
            assert alike == (hatched != "within")
    choose(driver, "column", names.index("q/joint1"))
    assert driver.execute_script(legend) == ["fast", "slow"]
    assert driver.get_log("browser") == []


def test_a_page_with_deviations_fits_a_phone(driver: Any, uncertain: Path) -> None:
    size = {"width": 390, "height": 844, "deviceScaleFactor": 2, "mobile": True}
    driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    opened(driver, (uncertain / "study.html").as_uri())
    assert driver.execute_script("return document.documentElement.scrollWidth") == 390
    driver.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})


def test_it_fits_a_phone(page: Any) -> None:
    size = {"width": 390, "height": 844, "deviceScaleFactor": 2, "mobile": True}
    page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    page.refresh()
    assert page.execute_script("return document.documentElement.scrollWidth") == 390
    page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
