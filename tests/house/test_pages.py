"""README.md and docs/ run as printed, lead to what is there, and build without a warning."""

import html
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import pytest
from linkwise_runtime.version import VERSION
from tools import pages

ROOT = pages.ROOT


def name_of(page: Path) -> str:
    return str(page.relative_to(ROOT))


@pytest.mark.ship
@pytest.mark.parametrize(
    "page", [p for p in pages.PAGES if any(b.runs for b in pages.blocks(p))], ids=name_of
)
def test_a_page_runs_as_printed(page: Path, tmp_path: Path) -> None:
    if reason := pages.lacking(page):
        pytest.skip(reason)
    # Each in a process of its own: their packages have the same names.
    paths = f"pathlib.Path({str(page)!r}), pathlib.Path({str(tmp_path)!r})"
    script = f"import pathlib; from tools import pages; pages.run_page({paths})"
    done = subprocess.run(
        [sys.executable, "-W", "error", "-c", script],
        cwd=ROOT / "tests",
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    for made, shown in pages.pictures(page):
        assert (tmp_path / made).is_file()
        assert shown.is_file()


@pytest.mark.parametrize("page", pages.PAGES, ids=name_of)
def test_every_block_of_a_page_is_run_written_or_an_excerpt(page: Path) -> None:
    for block in pages.blocks(page):
        place = f"{page.name}, line {block.line}"
        assert block.language, f"{place}: an indented block; say its language"
        if block.language.startswith("{"):  # a directive of Sphinx
            continue
        excerpt = block.language == "text" and block.word in ("", "printed")
        assert block.runs or block.word or excerpt, f"{place}: neither run nor written to a file"
        if excerpt and not block.word:
            assert not re.match(r"(\.venv/bin/)?(linkwise|python|pip|make) ", block.text), (
                f"{place}: a command"
            )


@pytest.mark.parametrize("page", pages.PAGES, ids=name_of)
def test_a_page_leads_to_what_is_there(page: Path) -> None:
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        path, _, anchor = target.partition("#")
        if re.match(r"\w+:", target):
            continue
        to = (page.parent / path).resolve() if path else page
        assert to.exists(), f"{page.name}: {target}"
        if anchor and to.suffix == ".md":
            heads = re.findall(r"^#+ (.+)$", to.read_text(encoding="utf-8"), flags=re.MULTILINE)
            slugs = {re.sub(r"[^\w\- ]", "", head.lower()).replace(" ", "-") for head in heads}
            assert anchor in slugs, f"{page.name}: {target}"


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The documentation as `make docs` makes it."""
    folder = tmp_path_factory.mktemp("site")
    command = [
        sys.executable,
        "-m",
        "sphinx",
        "--quiet",
        "--fail-on-warning",
        "--keep-going",
        "docs",
        str(folder),
    ]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.ship
def test_the_documentation_builds_without_a_warning(site: Path) -> None:
    assert (site / "index.html").is_file()


@pytest.mark.ship
def test_llms_txt_has_every_page_with_its_title_once(site: Path) -> None:
    text = (site / "llms.txt").read_text(encoding="utf-8")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    base = f"{project['urls']['Documentation']}/{VERSION}/"
    links = re.findall(r"^- \[([^\]]+)\]\((\S+)\)(?:: \S.*)?$", text, re.MULTILINE)
    told = {
        page.relative_to(ROOT / "docs").with_suffix(".html") for page in pages.PAGES if page.parent != ROOT
    }
    assert sorted(url for _, url in links) == sorted(base + str(page) for page in told - {Path("index.html")})
    for title, url in links:
        shown = (site / url.removeprefix(base)).read_text(encoding="utf-8")
        assert f"<title>{title} - " in html.unescape(shown), title
    index = (ROOT / "docs/index.md").read_text(encoding="utf-8")
    assert re.findall(r"^## (.+)$", text, re.MULTILINE) == re.findall(
        r"^:caption: (.+)$", index, re.MULTILINE
    )
    opening = index.split("\n\n")[1]
    assert text.startswith(f"# linkwise\n\n> {' '.join(opening.split())}\n\n## ")


TOO_WIDE = """
const scrolls = (e) => e && !e.matches(".content")
    && (["auto", "scroll"].includes(getComputedStyle(e).overflowX) || scrolls(e.parentElement));
const wide = [...document.querySelectorAll(".content, .content *")]
    .filter((e) => e.getBoundingClientRect().right > innerWidth + 0.5 && !scrolls(e.parentElement));
const whole = document.documentElement;
return [...wide, ...(whole.scrollWidth > innerWidth ? [whole] : [])].map((e) => e.outerHTML.slice(0, 80));
"""
"""Parts of a page right of its window, but for what scrolls by itself; the whole where its drawers do."""


@pytest.mark.ship
@pytest.mark.browser
def test_no_page_is_wider_than_its_window(site: Path, driver: Any) -> None:
    for page in sorted(site.rglob("*.html")):
        if "_static" in page.relative_to(site).parts:
            continue
        driver.get(page.as_uri())
        for width in (400, 1100, 1366):
            size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": False}
            driver.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", size)
            assert driver.execute_script(TOO_WIDE) == [], f"{page.name} at {width}"


def test_every_command_has_a_page_and_a_line_in_the_readme() -> None:
    done = subprocess.run(
        [sys.executable, "-m", "linkwise", "--help"], capture_output=True, text=True, check=True
    )
    names = re.findall(r"^│ (\w+) ", done.stdout, flags=re.MULTILINE)
    assert {"generate", "check", "inspect"} <= set(names)
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    for name in names:
        assert f"[`linkwise {name}`](docs/commands/{name}.md)" in text, name
