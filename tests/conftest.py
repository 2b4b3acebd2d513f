"""Packages that tests share: each robot is generated once a session and imported from its folder."""

import os

# Before NumPy and torch: files run side by side, and threads that wait for a busy core cost torch ten times.
os.environ.setdefault("OMP_NUM_THREADS", "1")

import ctypes
import gc
import shutil
import sys
import sysconfig
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from helpers.kept import keeping
from helpers.needed import missing, needs
from linkwise import Options, generate, read_system, write_package
from linkwise.package.emitted_text import foreign_text
from linkwise.package.load import import_package
from linkwise_runtime.native.process import run_all

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
SHARED: dict[str, Path] = {}
"""Packages of the session, by robot."""
LARGEST = 480
"""MB that a process of tests may hold, when it is through with a file, beyond what it held as tests began."""
SEARCHED = os.environ.get("LD_LIBRARY_PATH")
"""Folders in which programs that tests start look for libraries, before any file of tests is imported."""
BEGAN: list[int] = []
"""MB that it held then: imports of all files of tests, which libraries and Python's own cache decide on."""
M_ARENA_MAX = -8
"""Parameter of mallopt, by malloc.h."""
COMPILES = "torch.compile("
"""Text of files of tests after which torch's compilers leave fragments of memory."""
needs_compiler = needs("gcc")


@pytest.fixture(scope="session", autouse=True)
def own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Compiled packages go into a directory of the session, not the user's; mutants share one.

    What `linkwise check` compiles, and holds against the package, is kept there too.
    """
    session = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        session = session.parent  # so that what one process compiled is there for the other
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("LINKWISE_CACHE", os.environ.get("LINKWISE_TEST_CACHE") or str(session / "cache"))
        patch.setattr("linkwise.check.compiled_c.run_all", keeping(run_all))
        yield


@pytest.fixture(scope="session")
def directory_of(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """Directory of a robot's package; "planar3 symbolic" keeps parameters, "planar3 loops" is in loops."""

    def directory(robot: str) -> Path:
        if robot not in SHARED:
            read, kernel = robot.removesuffix(" loops"), "loops" if robot.endswith(" loops") else "straight"
            system = read_system(read.removesuffix(" symbolic"), OPTIONS.get(read))
            SHARED[robot] = tmp_path_factory.mktemp("package") / system.name
            write_package(generate(system, kernel=kernel), SHARED[robot])
        return SHARED[robot]

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


def pytest_configure() -> None:
    """Search for garbage seldom: most of what tests make is freed at once, and _forget searches as well.

    All threads take memory from one place: in places of their own, GNU's C library keeps fragments of what
    they have freed, a hundred MB in the end.
    """
    gc.set_threshold(50_000, 20, 100)
    if sys.platform == "linux":
        with suppress(OSError, AttributeError):  # another C library than GNU's
            ctypes.CDLL("libc.so.6").mallopt(M_ARENA_MAX, 1)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with what torch compiles, in whose fragments of memory later files find room, then studies.

    These take longest: the last file to begin would run alone.
    """

    paths = {item.path for item in items}
    compiles = {path for path in paths if COMPILES in path.read_text(encoding="utf-8")}

    def turn(item: pytest.Item) -> int:
        return 0 if item.path in compiles else 1 if item.path.parent.name == "study" else 2

    items.sort(key=turn)


def pytest_collection_finish() -> None:
    """Keep imports out of the search for garbage, and OpenSim's folder out of the environment.

    Its import sends all programs that start later to its own CasADi.
    """
    os.environ.pop("LD_LIBRARY_PATH", None)
    if SEARCHED is not None:
        os.environ["LD_LIBRARY_PATH"] = SEARCHED
    gc.collect()
    gc.freeze()
    if sys.platform == "linux":
        BEGAN.append(held_megabytes())


@pytest.fixture(scope="module", autouse=True)
def _forget() -> Iterator[None]:
    """A file of tests leaves no memory with what it imported or compiled for itself."""
    yield
    if robots := sys.modules.get("linkwise.study.robots"):
        robots.loaded.cache_clear()  # whose packages are forgotten next
    forget_packages()
    foreign_text.cache_clear()  # by texts of packages
    if compiler := sys.modules.get("torch._dynamo"):
        compiler.reset()
    if reader := sys.modules.get("griffe._internal.extensions.dataclasses"):
        for function in vars(reader).values():
            if hasattr(function, "cache_clear"):  # one keeps every class of every checkout that it has read
                function.cache_clear()
    gc.collect()
    if native := sys.modules.get("linkwise_runtime.native.memory"):
        native.lasting(native.MOST)  # which takes the place of all blocks that are kept for results to come
    if arrow := sys.modules.get("pyarrow"):
        arrow.default_memory_pool().release_unused()
    if sys.platform == "linux":
        with suppress(OSError, AttributeError):  # another C library than GNU's
            ctypes.CDLL("libc.so.6").malloc_trim(0)
        more = held_megabytes() - BEGAN[0]
        assert more <= LARGEST, (
            f"tests have left {more} MB in this process' memory, and {LARGEST} are the most"
        )


def forget_packages() -> None:
    """Forget imported packages, but those of the session."""
    kept = {os.path.realpath(directory) for directory in SHARED.values()}
    gone = {
        name
        for name, module in sys.modules.items()
        if name.startswith("_linkwise_")
        and "." not in name
        and os.path.dirname(str(module.__file__)) not in kept
    }
    for name in [name for name in sys.modules if name.partition(".")[0] in gone]:
        del sys.modules[name]
    sys.meta_path[:] = [finder for finder in sys.meta_path if getattr(finder, "name", None) not in gone]


def held_megabytes() -> int:
    """MB of memory that this process alone holds, on Linux: files of libraries are there once for all."""
    [line] = (row for row in Path("/proc/self/status").read_text().splitlines() if row.startswith("RssAnon:"))
    return int(line.split()[1]) // 1024


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Say what was skipped, a line for each reason: how many tests, of which files."""
    files: dict[str, Counter[str]] = {}
    for report in terminalreporter.getreports("skipped"):
        where, _, reason = report.longrepr if isinstance(report.longrepr, tuple) else ("", 0, "")
        of_reason = files.setdefault(reason.removeprefix("Skipped: "), Counter())
        of_reason["/".join(Path(report.nodeid.split("::")[0] or where).parts[-2:])] += 1
    for reason, counts in sorted(files.items()):
        terminalreporter.write_line(f"skipped {counts.total()} of {', '.join(counts)}: {reason}")
