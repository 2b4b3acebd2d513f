"""The study's page in a real browser: its numbers are the tables', and it leads to each trial."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linkwise.study import run_study
from linkwise.study.comparisons import Cluster, compared
from selenium.webdriver.support.wait import WebDriverWait
from studies import CHOICES, CYCLES, HEAD, TRIALS, Here, write_study

pd = pytest.importorskip("pandas")
pytestmark = pytest.mark.browser
COMPARE = '\n[[compare]]\nfactor = "condition"\nbetween = ["slow", "fast"]\ncolumns = ["tau/*"]\n'
CURVES = "return document.getElementById('bands').data.map(({name, y}) => [name, Array.from(y)])"


@pytest.fixture(scope="module")
def out(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of three subjects whose last log is broken."""
    folder = tmp_path_factory.mktemp("page")
    file = write_study(folder, HEAD, CHOICES, CYCLES, COMPARE, TRIALS, subjects=3, trials=2)
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


def test_its_curves_are_those_of_the_tables(page: Any, out: Path) -> None:
    curves = pd.read_parquet(out / "curves.parquet")
    shown = dict(page.execute_script(CURVES))
    for level in ("slow", "fast"):
        expected = curves[(curves.column == "tau/joint1") & (curves.condition == level)]["mean"]
        np.testing.assert_allclose(shown[level], expected, rtol=1e-5, atol=1e-5)


def test_it_leads_to_each_trial_and_tells_the_broken_one(page: Any) -> None:
    table = page.find_element("id", "trials")
    rows = [row.text for row in table.find_elements("css selector", "tbody tr")]
    assert len(rows) == 12
    assert rows[-1].startswith("S3-slow-2 S3 slow")
    assert "no column for joint" in rows[-1]
    link = table.find_element("link text", "S2-fast-1")
    opened(page, link.get_attribute("href"))
    assert page.title == "planar3 · fast_1.csv"


def test_a_trial_is_drawn_over_the_bands(page: Any) -> None:
    before = len(page.execute_script(CURVES))
    page.find_element("css selector", "#trials tbody tr").click()
    shown = page.execute_script(CURVES)
    assert (len(shown), shown[-1][0]) == (before + 1, "S1-fast-1")


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

    monkeypatch.setattr("linkwise.study.study_results.compared", of_that_part)
    compare = f"{COMPARE}alpha = {alpha}\n"
    file = write_study(tmp_path, HEAD, CHOICES, CYCLES, compare, TRIALS, subjects=3, trials=1)
    run_study(file, tmp_path / "out", Here())
    opened(driver, (tmp_path / "out/study.html").as_uri())
    assert f"36.97–37.01 % ({said})" in driver.find_element("id", "tests").text


def test_it_fits_a_phone(page: Any) -> None:
    size = {"width": 390, "height": 844, "deviceScaleFactor": 2, "mobile": True}
    page.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
    page.refresh()
    assert page.execute_script("return document.documentElement.scrollWidth") == 390
    page.execute_cdp_cmd("Emulation.clearDeviceMetricsOverride", {})
