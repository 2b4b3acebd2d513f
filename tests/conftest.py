"""Packages that tests share: each robot is generated once a session and imported from its folder."""

import os

# Before NumPy and torch: two files run at a time, and threads that wait for a busy core cost torch ten times.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import shutil
import sysconfig
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from needed import missing, needs

DATA = Path(__file__).parent / "data"
PANDA = (
    Path(sysconfig.get_path("purelib"))
    / "cmeel.prefix/share/example-robot-data/robots/panda_description/urdf/panda.urdf"
)
LOCKED_FINGERS = {"panda_finger_joint1": 0.0, "panda_finger_joint2": 0.0}
OPTIONS = {
    str(PANDA): Options(lock=LOCKED_FINGERS),
    "planar3 symbolic": Options("symbolic"),
}
needs_compiler = needs("gcc")


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Compiled packages go into a directory of the session, not the user's; mutants share one."""
    session = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        session = session.parent  # so that what one process compiled is there for the other
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LINKWISE_CACHE", os.environ.get("LINKWISE_TEST_CACHE") or str(session / "cache"))
        yield


@pytest.fixture(scope="session")
def directory_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Directory of a robot's package; "planar3 symbolic" keeps parameters, "planar3 loops" is in loops."""
    made: dict[str, Path] = {}

    def directory(robot: str) -> Path:
        if robot not in made:
            read, kernel = robot.removesuffix(" loops"), "loops" if robot.endswith(" loops") else "straight"
            system = read_system(read.removesuffix(" symbolic"), OPTIONS.get(read))
            made[robot] = tmp_path_factory.mktemp("package") / system.name
            write_package(generate(system, kernel=kernel), made[robot])
        return made[robot]

    return directory


@pytest.fixture(scope="session")
def package_of(directory_of: Callable[[str], Path]) -> Callable[[str], ModuleType]:
    """Imported package of a robot."""
    return lambda robot: import_package(directory_of(robot))


@pytest.fixture(scope="module")
def driver() -> Iterator[Any]:
    """A headless Chromium."""
    webdriver = pytest.importorskip("selenium.webdriver", reason="needs selenium: pip install selenium")
    browser = shutil.which("chromium-browser") or shutil.which("chromium")
    service = shutil.which("chromedriver")
    if absent := missing(*(["chromium"] if browser is None else []), "chromedriver"):
        pytest.skip(absent)
    options = webdriver.ChromeOptions()
    options.binary_location = browser
    for flag in ("headless=new", "no-sandbox", "disable-gpu", "disable-background-networking"):
        options.add_argument(f"--{flag}")
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    driver = webdriver.Chrome(options, webdriver.ChromeService(service))
    yield driver
    driver.quit()


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """What was skipped, a line for each reason: how many tests, of which files."""
    files: dict[str, Counter[str]] = {}
    for report in terminalreporter.getreports("skipped"):
        where, _, reason = report.longrepr if isinstance(report.longrepr, tuple) else ("", 0, "")
        of_reason = files.setdefault(reason.removeprefix("Skipped: "), Counter())
        of_reason[Path(report.nodeid.split("::")[0] or where).name] += 1
    for reason, counts in sorted(files.items()):
        terminalreporter.write_line(f"skipped {counts.total()} of {', '.join(counts)}: {reason}")
