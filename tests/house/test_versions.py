"""Pages of versions stand side by side and lead to one another; those of no version lead to the newest."""

import json
import subprocess
import sys
import threading
from collections.abc import Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from importlib import util
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
CONF = f"""
import runpy
house = runpy.run_path({str(ROOT / "docs/conf.py")!r})
names = [name for name in house if name.startswith(("templates_", "html_")) and name != "html_title"]
globals().update({{name: house[name] for name in names}})
templates_path = [{str(ROOT / "docs")!r} + "/" + path for path in templates_path]
html_static_path = [{str(ROOT / "docs")!r} + "/" + path for path in html_static_path]
"""


def tool() -> Any:
    """Return docs/versions.py, which is no module of a package."""
    spec = util.spec_from_file_location("versions", ROOT / "docs/versions.py")
    assert spec
    assert spec.loader
    module = util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def pages(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(name)


def test_what_has_no_version_leads_to_the_newest(tmp_path: Path) -> None:
    for version in ("0.9.0", "0.10.0"):
        pages(tmp_path / version, "index.html", "llms.txt", "commands/check.html")
    pages(tmp_path / "0.9.0", "old.html")
    pages(tmp_path, "drafts/index.html", "0.11.0/empty.txt", "latest/gone.html")
    tool().lead(tmp_path)
    assert json.loads((tmp_path / "versions.json").read_text()) == ["0.10.0", "0.9.0"]
    assert (tmp_path / "llms.txt").read_text() == "llms.txt"
    latest = {path.relative_to(tmp_path / "latest").as_posix() for path in (tmp_path / "latest").rglob("*.*")}
    assert latest == {"index.html", "commands/check.html"}
    for page in ("index.html", "latest/index.html", "latest/commands/check.html"):
        to = f"{'../' * page.count('/')}0.10.0/{page.removeprefix('latest/')}"
        assert (tmp_path / page).parent.joinpath(to).is_file()
        assert f'content="1; url={to}"' in (tmp_path / page).read_text()
    assert (tmp_path / "0.9.0/old.html").read_text() == "old.html"


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Two versions of a small site with the house's own sidebar, served from this machine to itself."""
    folder = tmp_path_factory.mktemp("versions")
    for version in ("0.2.0", "0.3.0"):
        source = folder / f"source {version}"
        named = f"project = 'arms'\nrelease = {version!r}\n"
        pages(source, "parts/arm.rst")
        (source / "conf.py").write_text(f"{CONF}{named}")
        (source / "index.rst").write_text("Arms\n====\n\n.. toctree::\n   :glob:\n\n   parts/*\n")
        for name in ("arm", *(("hand",) if version == "0.3.0" else ())):
            (source / f"parts/{name}.rst").write_text(f"{name}\n====\n\nA {name}.\n")
        build = [sys.executable, "-m", "sphinx", "--quiet", "--fail-on-warning", source, folder / version]
        subprocess.run(build, check=True)
        pages(folder / version, "llms.txt")
    tool().lead(folder)
    handler = partial(SimpleHTTPRequestHandler, directory=str(folder))
    handler.log_message = lambda *_: None  # type: ignore[attr-defined]
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as running:
        thread = threading.Thread(target=running.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{running.server_port}"
        running.shutdown()
        thread.join()


@pytest.mark.ship
@pytest.mark.browser
def test_the_sidebar_leads_to_the_same_page_of_another_version_or_to_its_index(
    server: str, driver: Any
) -> None:
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.ui import Select, WebDriverWait

    def choose(version: str, page: str) -> None:
        label = driver.find_element(By.CLASS_NAME, "versions")
        WebDriverWait(driver, 10).until(lambda _: label.is_displayed())
        choice = Select(label.find_element(By.TAG_NAME, "select"))
        assert [option.text for option in choice.options] == ["0.3.0", "0.2.0"]
        assert choice.first_selected_option.text != version
        choice.select_by_visible_text(version)
        WebDriverWait(driver, 10).until(lambda _: driver.current_url == f"{server}/{version}/{page}")

    driver.set_window_size(1300, 900)
    driver.get(f"{server}/latest/parts/arm.html#arm")
    WebDriverWait(driver, 10).until(lambda _: driver.current_url == f"{server}/0.3.0/parts/arm.html#arm")
    choose("0.2.0", "parts/arm.html#arm")
    choose("0.3.0", "parts/arm.html#arm")
    driver.get(f"{server}/0.3.0/parts/hand.html")
    choose("0.2.0", "index.html")
    driver.get(server)
    WebDriverWait(driver, 10).until(lambda _: driver.current_url == f"{server}/0.3.0/index.html")
