"""The archives of linkwise, and what they are worth in an environment of their own with the core alone."""

import json
import os
import re
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path, PurePosixPath

import numpy as np
import pinocchio as pin
import pytest
from helpers.installation import ROOT, Environment, copied, empty_environment
from helpers.needed import needs
from linkwise import generate, read_system, write_package
from linkwise.example_cases import example_cases
from linkwise_runtime.version import VERSION
from tools.pages import PAGES, blocks

from release.archives import Archives, built

pytestmark = pytest.mark.ship
CORE_MEGABYTES = 200
EXAMPLES_KILOBYTES = 400
RUNNING_MEGABYTES = 90
HELP_SECONDS = 0.5
MOTION = ([0.3, -0.7], [1.0, 0.5], [2.0, -3.0])


@pytest.fixture(scope="session")
def runtime(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of the runtime alone, beside the copy of the checkout in which it is built."""
    folder = tmp_path_factory.mktemp("archives")
    return built(copied(folder / "checkout") / "generator/linkwise_runtime", folder / "runtime").wheel


@pytest.fixture(scope="session")
def archives(runtime: Path) -> Archives:
    """The archive of sources, made where the runtime's wheel was, and the wheel that is built from it."""
    folder = runtime.parents[1]
    return built(folder / "checkout", folder / "archives")


@pytest.fixture(scope="session")
def clean(archives: Archives, tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """The wheel installed outside the checkout, with what it needs and no extra."""
    environment = empty_environment(tmp_path_factory.mktemp("installed") / "venv")
    environment.link(["linkwise"])
    assert not list(environment.packages.glob("*linkwise*"))
    environment.install(archives.wheel)
    return environment


@pytest.fixture(scope="session")
def builder(archives: Archives, tmp_path_factory: pytest.TempPathFactory) -> Environment:
    """An environment of projects that generate their robot as they are built."""
    environment = empty_environment(tmp_path_factory.mktemp("builder") / "venv")
    environment.link(["linkwise", "build", "setuptools", "scikit-build-core"])
    environment.install(archives.wheel)
    return environment


def files_below(folder: Path) -> set[str]:
    found = (path.relative_to(folder) for path in folder.rglob("*") if path.is_file())
    return {path.as_posix() for path in found if path.suffix != ".pyc" and ".egg-info" not in str(path)}


def test_the_archive_of_sources_is_the_checkout(archives: Archives, tmp_path: Path) -> None:
    with tarfile.open(archives.sources) as archive:
        packed = {name.partition("/")[2] for name in archive.getnames() if archive.getmember(name).isfile()}
    own = {name for name in packed if ".egg-info/" in name} | {"PKG-INFO", "setup.cfg"}
    assert packed - own == files_below(copied(tmp_path / "checkout"))


def test_the_wheel_has_the_generator_its_templates_examples_and_licence_and_nothing_else(
    archives: Archives,
) -> None:
    with zipfile.ZipFile(archives.wheel) as wheel:
        packed = [one for one in wheel.infolist() if one.filename.startswith("linkwise/examples/")]
        assert sum(one.compress_size for one in packed) <= 1000 * EXAMPLES_KILOBYTES
        record = f"linkwise-{VERSION}.dist-info"
        parts = {name for name in wheel.namelist() if not name.startswith(f"{record}/")}
        assert wheel.read(f"{record}/licenses/LICENSE") == (ROOT / "LICENSE").read_bytes()
        metadata = wheel.read(f"{record}/METADATA").decode()
    assert "License-Expression: Apache-2.0 AND CC-BY-3.0\n" in metadata
    of_the_runtime = ("README.md", "pyproject.toml")  # its own wheel's
    kept = {f"linkwise_runtime/{name}" for name in of_the_runtime}
    generator = {name for name in files_below(ROOT / "generator") if "__pycache__" not in name} - kept
    templates = {f"linkwise/templates/{name}" for name in files_below(ROOT / "templates")}
    cases = {f"linkwise/examples/{name}" for name in files_below(ROOT / "examples/cases")}
    assert parts == generator | templates | cases
    assert {PurePosixPath(name).suffix for name in parts - cases} == {
        *(".py", ".typed", ".cmake", ".toml", ".h", ".c", ".j2", "")
    }


def test_first_commands_run_in_a_clean_environment(clean: Environment, tmp_path: Path) -> None:
    assert clean.run("linkwise", "--version", folder=tmp_path) == f"linkwise {VERSION}\n"
    asked = "from importlib.util import find_spec as f; print(f('linkwise').origin, f('torch'), f('pytest'))"
    where, *absent = clean.run("python", "-c", asked, folder=tmp_path).split()
    assert Path(where).is_relative_to(clean.packages)
    assert absent == ["None", "None"]
    clean.run("linkwise", "generate", "planar3", "--out", "generated", folder=tmp_path)
    manifest = json.loads((tmp_path / "generated/planar3/manifest.json").read_text())
    assert manifest["generator"]["linkwise"] == VERSION
    example = next(block.text for block in blocks(PAGES[0]) if block.language == "python")
    said = clean.run("python", "-c", example, folder=tmp_path)
    assert re.match(r"joint 1 carries -?\d+\.\d+ N m", said)
    cache = str(tmp_path / "cache")
    proved = clean.run("linkwise", "check", "generated/planar3", folder=tmp_path, LINKWISE_CACHE=cache)
    assert "torch" in proved
    assert "joint1" in clean.run("linkwise", "inspect", "planar3", folder=tmp_path)
    assert "| τ_1,3 |" in clean.run("linkwise", "report", "terms", "planar3", folder=tmp_path)
    for name in example_cases():
        assert name in clean.run("linkwise", "example", folder=tmp_path)
        written = clean.run("linkwise", "example", name, folder=tmp_path)
        assert written.startswith(f"wrote {name}: ")
    assert files_below(tmp_path / "walk") == set(example_cases()["walk"].files)
    module = clean.run("linkwise", "--cmake-dir", folder=tmp_path).strip()
    assert Path(module) == clean.packages / "linkwise/cmake"


def test_help_comes_within_half_a_second(clean: Environment, tmp_path: Path) -> None:
    seconds = []
    for _ in range(8):  # of the processor, and the fewest: others may keep this machine busy
        before = os.times()
        assert "generate" in clean.run("linkwise", "--help", folder=tmp_path)
        after = os.times()
        used = (after.children_user - before.children_user, after.children_system - before.children_system)
        seconds.append(sum(used))
        if seconds[-1] <= HELP_SECONDS:
            break
    assert 0 < min(seconds) <= HELP_SECONDS


def test_the_core_alone_is_small(clean: Environment) -> None:
    assert 20e6 < size_of(clean) <= CORE_MEGABYTES * 1e6


def size_of(environment: Environment) -> int:
    """Bytes of all that is installed; `python -O` leaves files of its own beside what pip compiles."""
    return sum(
        os.stat(Path(folder, file)).st_size
        for folder, _, files in os.walk(environment.packages, followlinks=True)
        for file in files
        if ".opt-" not in file
    )


@pytest.mark.parametrize("carried", [False, True], ids=["the runtime's wheel", "a copy in the package"])
def test_a_package_runs_where_there_is_numpy_and_its_runtime_alone(
    carried: bool, runtime: Path, tmp_path: Path
) -> None:
    machine = empty_environment(tmp_path / "machine")
    machine.link(["numpy"])
    if not carried:
        machine.install(runtime)
    robot = ROOT / "examples/setuptools/arm.urdf"
    files = generate(read_system(robot), ["numpy"], "arm", vendor_runtime=carried)
    write_package(files, tmp_path / "arm")
    program = f"import arm; print(*arm.load('numpy').partial_torque(*{MOTION}).ravel())"
    shares = np.array(machine.run("python", "-c", program, folder=tmp_path).split(), float)
    assert shares == pytest.approx(torques_by_pinocchio(robot).ravel(), rel=1e-12)
    asked = "from importlib.util import find_spec as f; print(*map(f, ('sympy', 'torch', 'linkwise')))"
    assert machine.run("python", "-c", asked, folder=tmp_path).split() == ["None"] * 3
    assert 20e6 < size_of(machine) <= RUNNING_MEGABYTES * 1e6


def test_linkwise_says_so_where_another_runtime_took_the_place_of_its_own_or_it_is_gone(
    archives: Archives, tmp_path: Path
) -> None:
    machine = empty_environment(tmp_path / "machine")
    machine.link(["linkwise"])
    machine.install(archives.wheel)
    version = machine.packages / "linkwise_runtime/version.py"
    version.write_text(version.read_text().replace(VERSION, "10.1.0"))
    mend = "install linkwise again, with --force-reinstall, and no linkwise-runtime beside it"
    for told in (f"linkwise {VERSION} finds linkwise_runtime 10.1.0 in its place", "linkwise_runtime, which"):
        done = subprocess.run(
            [machine.python.with_name("linkwise"), "--version"], capture_output=True, text=True, check=False
        )
        assert done.returncode == 2
        assert done.stderr.startswith(f"linkwise: error: {told}")
        assert done.stderr.endswith(f"{mend}\n")
        shutil.rmtree(machine.packages / "linkwise_runtime", ignore_errors=True)


def test_the_runtime_refuses_packages_of_another_version_in_one_line(tmp_path: Path) -> None:
    files = generate(read_system("planar1"), ["numpy"], "arm")
    files["__init__.py"] = files["__init__.py"].replace(f'require("{VERSION}")', 'require("9.1.0")')
    write_package(files, tmp_path / "arm")
    done = subprocess.run(
        [sys.executable, "-c", "import arm"], cwd=tmp_path, capture_output=True, text=True, check=False
    )
    last = done.stderr.splitlines()[-1]
    assert last == (
        f"ImportError: this package is made for linkwise_runtime 9.1.0, but {VERSION} is installed: generate "
        "it again, or install linkwise 9.1.0, or linkwise-runtime 9.1.0 where linkwise is not"
    )


def test_the_version_is_written_once(tmp_path: Path) -> None:
    history = {"CHANGELOG.md", "docs/speed.md", "generator/linkwise_runtime/version.py"}
    literal = re.compile(rf"(?<![\d.]){re.escape(VERSION)}(?![\d.])".encode())
    folder = copied(tmp_path / "checkout")
    found = {name for name in files_below(folder) if literal.search((folder / name).read_bytes())}
    found -= {"constraints.txt", "docs/sweeps.md"}  # versions of others, and of what was swept
    assert {name for name in found if not name.startswith("generated/")} == history


def test_the_changelog_begins_with_this_version() -> None:
    headings = re.findall(r"^## \[?([\w.]+)\]?", (ROOT / "CHANGELOG.md").read_text(), re.MULTILINE)
    assert headings[0] in (VERSION, "Unreleased")
    assert VERSION in headings


def torques_by_pinocchio(robot: Path) -> np.ndarray:
    """Return the torques of each joint through each link, by models in which that link alone has mass."""
    model = pin.buildModelFromUrdf(str(robot))
    links = range(1, model.njoints)
    columns = []
    for link in links:
        alone = model.copy()
        for other in links:
            if other != link:
                alone.inertias[other] = pin.Inertia.Zero()
        columns.append(pin.rnea(alone, alone.createData(), *map(np.array, MOTION)).copy())
    return np.array(columns).T


def example(name: str, folder: Path) -> Path:
    return shutil.copytree(ROOT / "examples" / name, folder / name)


def test_a_wheel_of_setuptools_has_its_robot(builder: Environment, tmp_path: Path) -> None:
    project = example("setuptools", tmp_path)
    wheel = built(project, tmp_path / "archives", builder.python).wheel
    user = empty_environment(tmp_path / "user")
    user.link(["numpy"])
    user.install(wheel)
    program = f"import arm_report; print(*arm_report.shares(*{MOTION}).values())"
    shares = np.array(user.run("python", "-c", program, folder=tmp_path).split(), float)
    assert shares == pytest.approx(torques_by_pinocchio(project / "arm.urdf").ravel(), rel=1e-12)


def test_an_editable_install_of_setuptools_has_its_robot_beside_the_sources(
    builder: Environment, tmp_path: Path
) -> None:
    project = example("setuptools", tmp_path)
    builder.install(project, "--no-build-isolation", "--editable")
    program = "import arm_report.arm as arm; print(arm.__file__)"
    assert Path(builder.run("python", "-c", program, folder=tmp_path).strip()).is_relative_to(project)


@needs("cmake", "ninja", "cc")
def test_a_wheel_of_scikit_build_core_has_its_robot(builder: Environment, tmp_path: Path) -> None:
    project = example("scikit-build-core", tmp_path)
    user = empty_environment(tmp_path / "user")
    user.install(built(project, tmp_path / "archives", builder.python).wheel)
    program = f"""from array import array
from arm_control import JOINTS, inverse_dynamics
tau = array("d", [0.0] * JOINTS)
inverse_dynamics(*(array("d", row) for row in {MOTION}), tau)
print(*tau)
try:
    inverse_dynamics(*(array("f", [0.0] * 2 * JOINTS) for _ in range(4)))
except ValueError as error:
    print(error)
"""
    numbers, refused = user.run("python", "-c", program, folder=tmp_path).splitlines()
    expected = torques_by_pinocchio(project / "arm.urdf").sum(axis=1)
    assert np.array(numbers.split(), float) == pytest.approx(expected, rel=1e-12)
    assert refused == "q, qd, qdd and tau must be equally many doubles, 2 a sample"
