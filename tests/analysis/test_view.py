"""View of a robot in space on the page: undistorted, from above, all of it, turned as it is dragged."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.motion_logs import smooth, write_csv
from linkwise import generate, read_system, write_package
from linkwise.analysis import Analysis, analyze
from linkwise.analysis.show.page import report, stick_figure
from selenium.webdriver.common.action_chains import ActionChains
from selenium.webdriver.support.wait import WebDriverWait

pytestmark = pytest.mark.browser
SAMPLES = 60
EDGE = 30
"""Pixels that are left free on each side of the figure."""


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> tuple[Analysis, Path]:
    """A movement of six joints, and its page."""
    place = tmp_path_factory.mktemp("view")
    write_package(generate(read_system("puma560"), ["numpy"]), place / "puma560")
    log = write_csv(place / "a.csv", smooth(SAMPLES, 6), [f"joint{k}" for k in range(1, 7)])
    analysis = analyze(log, place / "puma560")
    (place / "report.html").write_text(report(analysis), encoding="utf-8")
    return analysis, place / "report.html"


@pytest.fixture
def page(driver: Any, result: tuple[Analysis, Path]) -> Any:
    driver.get(result[1].as_uri())
    drawn = "return 'drawn' in document.documentElement.dataset"
    WebDriverWait(driver, 20).until(lambda driver: driver.execute_script(drawn))
    yield driver
    assert driver.get_log("browser") == []


def dots(page: Any, at: int) -> np.ndarray:
    """Pixels of joints and centres of mass of an instant, (2 bodies, 2)."""
    page.execute_script(
        "const e = document.getElementById('slider'); e.value = arguments[0];"
        "e.dispatchEvent(new Event('input', {bubbles: true}));",
        str(at),
    )
    return np.array(
        page.execute_script(
            "return [...document.querySelectorAll('#stick circle')]"
            ".map((dot) => ['cx', 'cy'].map((at) => Number(dot.getAttribute(at))))"
        )
    )


def view(page: Any, analysis: Analysis) -> np.ndarray:
    """Right, up and towards the reader, as unit vectors of the world, by what the page draws."""
    at = SAMPLES // 2
    seen = dots(page, at) * [1, -1]
    origins, centres = stick_figure(analysis.robot, analysis.q)
    world = np.stack([origins[at], centres[at]], axis=1).reshape(-1, 3)
    (right, up), rest, *_ = (m.T for m in np.linalg.lstsq(world - world[0], seen - seen[0], rcond=None)[:2])
    assert np.sqrt(rest).max() < 0.1
    scale = np.linalg.norm(right)
    assert np.linalg.norm(up) == pytest.approx(scale, rel=1e-3)
    assert right @ up == pytest.approx(0, abs=1e-3 * scale**2)
    return np.stack([right, up, np.cross(right, up) / scale]) / scale


def test_a_robot_in_space_is_seen_upright_and_from_above(page: Any, result: tuple[Analysis, Path]) -> None:
    right, up, towards = view(page, result[0])
    assert right[2] == pytest.approx(0, abs=1e-3)
    assert up[2] > 0.5
    assert 0.1 < towards[2] < up[2]


def test_all_of_the_movement_is_in_the_figure_at_any_width(page: Any) -> None:
    for width in (1280, 500):
        page.set_window_size(width, 900)
        size = page.execute_script(
            "const box = document.getElementById('stick').getBoundingClientRect();"
            "return new Promise((done) => requestAnimationFrame(() => done([box.width, box.height])));"
        )
        seen = np.concatenate([dots(page, at) for at in range(0, SAMPLES, 6)])
        assert (seen >= EDGE - 0.5).all()
        assert (seen <= np.array(size) - EDGE + 0.5).all()
        assert page.find_element("id", "stick").get_dom_attribute("viewBox").startswith("0 0 ")
        free = np.minimum(seen.min(axis=0), np.array(size) - seen.max(axis=0))
        assert free.min() < 0.2 * min(size)


def test_what_is_in_front_follows_the_pointer(page: Any, result: tuple[Analysis, Path]) -> None:
    page.set_window_size(1280, 900)
    before = view(page, result[0])
    stick = page.find_element("id", "stick")
    ActionChains(page).click_and_hold(stick).move_by_offset(60, 0).release().perform()
    turned = view(page, result[0])
    assert turned[0] @ before[2] == pytest.approx(np.sin(0.5) * np.hypot(*before[2][:2]), abs=1e-2)
    assert turned[1][2] == pytest.approx(before[1][2], abs=1e-3)
    ActionChains(page).click_and_hold(stick).move_by_offset(0, 60).release().perform()
    tilted = view(page, result[0])
    assert tilted[1] @ turned[2] == pytest.approx(-np.sin(0.5), abs=1e-2)
    fits = dots(page, 0)
    page.execute_script("window.dispatchEvent(new Event('resize'))")
    page.execute_script("return new Promise((done) => setTimeout(done, 300))")
    np.testing.assert_allclose(dots(page, 0), fits, atol=1e-6)
    ActionChains(page).move_to_element(stick).move_by_offset(-60, -60).perform()
    np.testing.assert_allclose(view(page, result[0]), tilted, atol=1e-3)
