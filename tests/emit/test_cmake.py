"""Robots in the CMake builds of others: C and C++ programs, and what is built again when."""

import os
import re
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import linkwise
import numpy as np
import pytest
from helpers import urdf_text
from helpers.needed import needs
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise_runtime.version import VERSION

pytestmark = [pytest.mark.ship, needs("cmake", "cc", "c++")]
GENERATORS = {"ninja": "Ninja", "make": "Unix Makefiles"}
each_generator = pytest.mark.parametrize(
    "tool",
    [pytest.param(tool, marks=needs(tool)) for tool in GENERATORS],
)
needs_ninja = needs("ninja")
MODULE = Path(linkwise.__file__).parent / "cmake"
PROGRAM = Path(sys.executable).parent / "linkwise"

LISTS = """cmake_minimum_required(VERSION 3.20)
project(robots LANGUAGES C CXX)
find_package(linkwise CONFIG REQUIRED)
linkwise_add_robot(arm ROBOT "arm one.urdf" STATIC)
foreach(tool CLANG_TIDY CPPCHECK CPPLINT INCLUDE_WHAT_YOU_USE)
    set(CMAKE_C_${tool} false)
endforeach()
linkwise_add_robot(arm_shared ROBOT "arm one.urdf" NAME arm SHARED)
set(kind INTERFACE) # the project's own
linkwise_add_robot(arm_float ROBOT "arm one.urdf" NAME arm FLOAT)
foreach(tool CLANG_TIDY CPPCHECK CPPLINT INCLUDE_WHAT_YOU_USE)
    unset(CMAKE_C_${tool})
endforeach()
add_executable(in_c main.c)
target_link_libraries(in_c PRIVATE arm)
add_executable(in_cpp main.cpp)
target_link_libraries(in_cpp PRIVATE arm_shared)
add_executable(in_float float.c)
target_link_libraries(in_float PRIVATE arm_float)
add_library(m INTERFACE)
"""
C = """#include "arm.h"
#include <stdio.h>
int main(void)
{
    const real q[ARM_JOINTS] = {0.3, -0.7}, qd[ARM_JOINTS] = {1, 0.5}, qdd[ARM_JOINTS] = {2, -3};
    real tau[ARM_JOINTS];
    arm_inverse_dynamics(1, q, qd, qdd, tau);
    printf("%.17g %.17g\\n", tau[0], tau[1]);
    return arm_lower_limit[0] != -9 || arm_effort_limit[1] != 9 || arm_joint_names[1][0] != 'b';
}
"""
MOTION = (np.array([0.3, -0.7]), np.array([1, 0.5]), np.array([2.0, -3.0]))


def urdf(mass: str = "1.5") -> str:
    parts = [urdf_text.link(name, mass) for name in "abc"]
    return urdf_text.robot(*parts, urdf_text.joint("ab", "a", "b"), urdf_text.joint("bc", "b", "c"))


@dataclass(frozen=True)
class Project:
    """A project in a folder with a space in its name; program: the folder of linkwise's."""

    tool: str
    source: Path
    program: Path = PROGRAM.parent

    @property
    def build(self) -> Path:
        return self.source / "made here"

    @property
    def robot(self) -> Path:
        return self.source / "arm one.urdf"

    def configure(self, *options: str) -> subprocess.CompletedProcess[str]:
        command = ["cmake", "-G", GENERATORS[self.tool], "-S", str(self.source), "-B", str(self.build)]
        path = f"{self.program}{os.pathsep}{os.environ['PATH']}"
        return subprocess.run(
            [*command, f"-Dlinkwise_DIR={MODULE}", *options],
            env=os.environ | {"PATH": path},
            capture_output=True,
            text=True,
            check=False,
        )

    def make(self, *words: str) -> str:
        done = subprocess.run(
            ["cmake", "--build", str(self.build), *words], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
        return done.stdout

    def answer(self, program: str, *emulator: str) -> list[float]:
        done = subprocess.run([*emulator, self.build / program], capture_output=True, text=True, check=True)
        return [float(word) for word in done.stdout.split()]

    def times(self) -> dict[str, int]:
        files = (path for path in self.build.rglob("*") if path.suffix in (".o", ".a", ".so", ".stamp", ".h"))
        return {path.relative_to(self.build).as_posix(): path.stat().st_mtime_ns for path in files}


def write_project(folder: Path, lists: str = LISTS) -> None:
    folder.mkdir()
    (folder / "CMakeLists.txt").write_text(lists)
    (folder / "arm one.urdf").write_text(urdf())
    (folder / "main.c").write_text(C.replace("real", "double"))
    (folder / "main.cpp").write_text(C.replace("real", "double"))
    (folder / "float.c").write_text(C.replace("real", "float").replace("dynamics(", "dynamicsf("))


@pytest.fixture(scope="session")
def built(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Project]:
    """The project built by each tool that is here, as many commands at a time as there are."""
    projects = {}
    for tool in GENERATORS:
        if shutil.which(tool):
            project = Project(tool, tmp_path_factory.mktemp(tool) / "my project")
            write_project(project.source)
            hidden = "-DCMAKE_C_VISIBILITY_PRESET=hidden"  # of what the project exports, not of its robots
            flags = "-DCMAKE_C_FLAGS=-Wall -Wextra -Werror"
            done = project.configure(flags, hidden, "-DCMAKE_BUILD_TYPE=Debug")
            assert done.returncode == 0, done.stderr
            project.make("--parallel", "8")
            projects[tool] = project
    return projects


def expected(project: Project, folder: Path) -> np.ndarray:
    """Return what Python says to the same motion."""
    write_package(generate(read_system(project.robot), ["numpy"]), folder / "arm_in_python")
    robot = import_package(folder / "arm_in_python").load("numpy")
    return np.asarray(robot.inverse_dynamics(*MOTION))


@each_generator
def test_programs_in_c_and_cpp_say_what_python_does(
    tool: str, built: dict[str, Project], tmp_path: Path
) -> None:
    tau = expected(built[tool], tmp_path)
    for program, accuracy in (("in_c", 1e-14), ("in_cpp", 1e-14), ("in_float", 1e-6)):
        assert built[tool].answer(program) == pytest.approx(tau, rel=accuracy, abs=accuracy), program


@each_generator
def test_robots_are_compiled_as_their_headers_say(tool: str, built: dict[str, Project]) -> None:
    names = {"ninja": ("build.ninja",), "make": ("flags.make",)}[tool]
    told = "".join(path.read_text() for path in built[tool].build.rglob("*") if path.name in names)
    flags = ("-ftree-vectorize", "-fno-tree-slp-vectorize", "-ffp-contract=fast")
    assert [told.count(flag) for flag in flags] == [3] * 3  # one robot, as three libraries


@needs_ninja
def test_a_level_of_the_projects_own_flags_stays_and_else_it_is_a_quick_one(tmp_path: Path) -> None:
    project = Project("ninja", tmp_path / "level")
    write_project(project.source)
    for flags, count in (
        ("-DCMAKE_C_FLAGS=-Os", 0),
        ("-DCMAKE_C_FLAGS=-g\t-Os", 0),
        ("-DCMAKE_C_FLAGS=-g", 3),
    ):
        done = project.configure(flags)
        assert done.returncode == 0, done.stderr
        assert (project.build / "build.ninja").read_text().count(" -O2") == count


@needs_ninja
def test_the_level_that_holds_is_that_of_compile_options_or_of_the_build_type(tmp_path: Path) -> None:
    find = "find_package(linkwise"
    for number, (options, flags, level) in enumerate(
        (
            ("-Os", "", "-Os"),
            ("-Os -O2", "", "-O2"),
            ("$<$<COMPILE_LANGUAGE:C>:-O1>", "", "-O1"),
            ("-g", "", "-O2"),
            ("-g", "-DCMAKE_BUILD_TYPE=Firmware", "-O2"),
            ("-Os", "-DCMAKE_BUILD_TYPE=Firmware", "-Os"),
            ("-g", "-DCMAKE_BUILD_TYPE=Release", "-O3"),
            ("-g", "-DCMAKE_BUILD_TYPE=Debug", None),
        )
    ):
        project = Project("ninja", tmp_path / f"level {number}")
        write_project(project.source, LISTS.replace(find, f"add_compile_options({options})\n{find}"))
        done = project.configure(*flags.split())
        assert done.returncode == 0, done.stderr
        lines = (project.build / "build.ninja").read_text().splitlines()
        found = [re.findall(r" (-O\w)", line) for line in lines if "-ftree-vectorize" in line]
        assert [one[-1] if one else None for one in found] == [level] * 3, (options, flags)


@each_generator
def test_touching_nothing_builds_nothing_within_a_second(tool: str, built: dict[str, Project]) -> None:
    project = built[tool]
    project.make()
    before, seconds = project.times(), []
    for _ in range(3):  # the fastest: others may keep this machine busy
        start = time.monotonic()
        said = project.make()
        seconds.append(time.monotonic() - start)
    assert project.times() == before
    assert "Generating" not in said
    assert "Building" not in said
    assert min(seconds) < 1.0
    assert tool != "ninja" or said == "ninja: no work to do.\n"


@each_generator
def test_touching_the_robot_generates_and_compiles_what_differs_only(
    tool: str, built: dict[str, Project]
) -> None:
    project = built[tool]
    before, answer = project.times(), project.answer("in_c")
    time.sleep(0.02)
    project.robot.write_text(urdf())
    said = project.make()
    assert "Generating the dynamics of arm" in said
    assert "Building" not in said
    after = project.times()
    stamps = {f"linkwise/{target}/arm.stamp" for target in ("arm", "arm_shared", "arm_float")}
    assert {name for name in after if after[name] != before[name]} == stamps
    time.sleep(0.02)
    project.robot.write_text(urdf(mass="2.5"))
    said = project.make()
    assert "Building C object CMakeFiles/arm.dir" in said
    assert project.answer("in_c") != pytest.approx(answer)
    assert project.answer("in_cpp") == pytest.approx(project.answer("in_c"), rel=1e-14)
    project.robot.write_text(urdf())
    project.make()
    assert project.answer("in_c") == answer
    assert "Generating" not in project.make()


@each_generator
def test_a_file_of_the_package_that_is_gone_or_changed_by_hand_is_made_again(
    tool: str, built: dict[str, Project]
) -> None:
    project = built[tool]
    package = project.build / "linkwise/arm/arm"
    before = {path: path.read_bytes() for path in package.rglob("*") if path.is_file()}
    for name in ("arm.h", "linkwise/mass.h", "arm.c"):
        (package / "c" / name).unlink()
    (package / "c/linkwise/tree.h").write_text("#error changed by hand\n")
    assert "Generating the dynamics of arm" in project.make()
    assert {path: path.read_bytes() for path in package.rglob("*") if path.is_file()} == before
    said = project.make()
    assert "Generating" not in said
    assert "Building" not in said


@each_generator
def test_what_a_robots_file_includes_builds_it_again(tool: str, tmp_path: Path) -> None:
    pytest.importorskip("mujoco")
    project = Project(tool, tmp_path / "included")
    lists = LISTS.partition("linkwise_add_robot")[0]
    write_project(project.source, f"{lists}linkwise_add_robot(hand ROBOT hand.xml)\n")
    body = (
        '<mujoco><worldbody><body name="a"><joint axis="0 1 0"/><geom size="{}"/></body></worldbody></mujoco>'
    )
    (project.source / "hand.xml").write_text('<mujoco><include file="rod.xml"/></mujoco>')
    (project.source / "rod.xml").write_text(body.format(0.1))
    assert project.configure().returncode == 0
    assert "Generating the dynamics of hand" in project.make()
    assert "Generating" not in project.make()
    (project.source / "rod.xml").write_text(body.format(0.2))
    assert "Building C object CMakeFiles/hand.dir" in project.make()
    assert "Generating" not in project.make()


@each_generator
def test_constraints_beside_the_robot_build_it_again(tool: str, tmp_path: Path) -> None:
    project = Project(tool, tmp_path / "bars")
    tree, mark, loop = (
        (Path(__file__).parents[1] / "data/fourbar.toml").read_text().partition("[[constraint]]")
    )
    lists = LISTS.partition("linkwise_add_robot")[0]
    write_project(
        project.source,
        f"{lists}linkwise_add_robot(bars ROBOT bars.toml OPTIONS --base fixed --constraints loop.toml)\n"
        "linkwise_add_robot(same ROBOT bars.toml OPTIONS --base fixed --constraints=loop.toml)\n",
    )
    (project.source / "bars.toml").write_text(tree)
    (project.source / "loop.toml").write_text(f"schema = 1\n{mark}{loop}")
    assert project.configure().returncode == 0
    project.make()
    assert "Generating" not in project.make()
    (project.source / "loop.toml").write_text(f"schema = 1\n# a remark\n{mark}{loop}")
    assert "Generating the dynamics of bars" in project.make()
    assert "Generating" not in project.make()


@each_generator
def test_an_interrupted_build_leaves_nothing_broken(
    tool: str, built: dict[str, Project], tmp_path: Path
) -> None:
    project = Project(tool, tmp_path / "interrupted")
    lists = LISTS.partition("linkwise_add_robot")[0]
    write_project(
        project.source,
        f'{lists}linkwise_add_robot(arm ROBOT "arm one.urdf" STATIC)\n'
        "add_executable(in_c main.c)\ntarget_link_libraries(in_c PRIVATE arm)\n",
    )
    assert project.configure().returncode == 0
    for round_, delay in enumerate((0.2, 0.6, 0.9, 1.2, 1.5, 1.8, 2.4)):
        project.robot.write_text(urdf(mass=str(1 + round_ % 2)))
        command = ["cmake", "--build", str(project.build), "--parallel", "4"]
        with subprocess.Popen(
            command, start_new_session=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        ) as building:
            time.sleep(delay)
            if building.poll() is None:
                os.killpg(building.pid, signal.SIGKILL if round_ == 3 else signal.SIGINT)
            building.wait()
        time.sleep(0.5)  # what a killed build had started may still be at work
    project.robot.write_text(urdf())
    project.make()
    assert project.answer("in_c") == pytest.approx(built[tool].answer("in_c"), rel=1e-12)
    assert "Generating" not in project.make()
    fresh, kept = (p.build / "linkwise/arm/arm/manifest.json" for p in (built[tool], project))
    assert fresh.read_bytes() == kept.read_bytes()


@needs_ninja
def test_a_robot_that_a_command_before_makes_is_found(tmp_path: Path) -> None:
    project = Project("ninja", tmp_path / "made")
    lists = LISTS.partition("linkwise_add_robot")[0]
    copied = 'cmake -E copy "${CMAKE_SOURCE_DIR}/arm one.urdf" made.urdf'
    command = f'add_custom_command(OUTPUT made.urdf COMMAND {copied} DEPENDS "arm one.urdf")\n'
    write_project(project.source, f"{lists}{command}linkwise_add_robot(arm ROBOT made.urdf)\n")
    done = project.configure()
    assert done.returncode == 0, done.stderr
    assert "Generating the dynamics of arm" in project.make()


@each_generator
def test_a_robot_that_another_folder_makes_may_change_even_its_name(tool: str, tmp_path: Path) -> None:
    project = Project(tool, tmp_path / "renamed")
    lists = LISTS.partition("linkwise_add_robot")[0]
    write_project(
        project.source,
        f"{lists}add_subdirectory(made)\n"
        'linkwise_add_robot(arm ROBOT "${CMAKE_BINARY_DIR}/made/arm.urdf")\n'
        "add_dependencies(arm description)\n",
    )
    (project.source / "made").mkdir()
    (project.source / "made/CMakeLists.txt").write_text(
        'set(robot "${CMAKE_SOURCE_DIR}/arm one.urdf")\n'
        'add_custom_command(OUTPUT arm.urdf COMMAND cmake -E copy "${robot}" arm.urdf DEPENDS "${robot}")\n'
        "add_custom_target(description DEPENDS arm.urdf)\n"
    )
    assert project.configure().returncode == 0
    project.make("--target", "arm")
    rules = {"ninja": "build.ninja", "make": "CMakeFiles/arm.dir/flags.make"}[tool]
    assert "-fPIC" in (project.build / rules).read_text()  # the library may become part of a shared one
    project.robot.write_text(urdf().replace('robot name="test"', 'robot name="best"'))
    assert "Generating" in project.make()


@needs_ninja
def test_a_project_may_be_built_beside_the_build_that_it_is_part_of(tmp_path: Path) -> None:
    whole, part = Project("ninja", tmp_path / "whole"), tmp_path / "part"
    write_project(part, f"{LISTS.partition('linkwise_add_robot')[0]}add_subdirectory(made)\n")
    with (part / "CMakeLists.txt").open("a") as lists:
        lists.write('linkwise_add_robot(arm ROBOT "${PROJECT_BINARY_DIR}/made/arm.urdf")\n')
    (part / "made").mkdir()
    (part / "made/CMakeLists.txt").write_text(
        'set(robot "${PROJECT_SOURCE_DIR}/arm one.urdf")\n'
        'add_custom_command(OUTPUT arm.urdf COMMAND cmake -E copy "${robot}" arm.urdf)\n'
        "add_custom_target(description DEPENDS arm.urdf)\n"
    )
    head = "cmake_minimum_required(VERSION 3.20)\nproject(whole LANGUAGES C CXX)\n"
    write_project(whole.source, f"{head}add_subdirectory({part} {tmp_path / 'built'})\n")
    done = whole.configure()
    assert done.returncode == 0, done.stderr


@needs_ninja
def test_a_project_of_cpp_alone_and_one_for_another_machine(tmp_path: Path) -> None:
    project = Project("ninja", tmp_path / "cpp")
    lists = LISTS.partition("linkwise_add_robot")[0].replace("C CXX", "CXX")
    write_project(
        project.source,
        f'{lists}linkwise_add_robot(arm ROBOT "arm one.urdf")\nadd_executable(in_cpp main.cpp)\n'
        "target_link_libraries(in_cpp PRIVATE arm)\n",
    )
    hidden = "-DCMAKE_CXX_VISIBILITY_PRESET=hidden"
    assert project.configure("-DBUILD_SHARED_LIBS=ON", hidden).returncode == 0
    assert "Building CXX object CMakeFiles/arm.dir" in project.make()
    assert len(project.answer("in_cpp")) == 2


@needs_ninja
def test_for_another_machine_nothing_of_it_is_run_nor_found_among_its_programs(tmp_path: Path) -> None:
    project = Project("ninja", tmp_path / "cross")
    lists = LISTS.partition("add_executable")[0].replace(
        "find_package", "set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM ONLY)\nfind_package"
    )
    write_project(project.source, lists)
    (project.source / "bare.cmake").write_text(
        "set(CMAKE_SYSTEM_NAME Generic)\nset(CMAKE_C_COMPILER cc)\nset(CMAKE_CXX_COMPILER c++)\n"
        "set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)\nset(CMAKE_FIND_ROOT_PATH /nowhere)\n"
        "set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE NEVER)\n"
    )
    done = project.configure(f"-DCMAKE_TOOLCHAIN_FILE={project.source / 'bare.cmake'}")
    assert done.returncode == 0, done.stderr
    project.make("--target", "arm")
    assert (project.build / "libarm.a").is_file()
    assert "-fPIC" not in (project.build / "build.ninja").read_text()


MISTAKES = {
    "linkwise_add_robot(arm ROBOT gone.urdf)": "ROBOT gone.urdf: no such file, nor one that a command before",
    "linkwise_add_robot(_arm ROBOT planar1)": "_arm is not a name of letters, digits and _; give",
    "linkwise_add_robot(arm)": "arm has no robot; give ROBOT and its file",
    "linkwise_add_robot(arm ROBOT planar1 --base floating)": "give those of linkwise behind OPTIONS",
    "linkwise_add_robot(arm ROBOT planar1 STATIC SHARED)": "arm cannot be both STATIC and SHARED",
    "find_package(linkwise 99 CONFIG REQUIRED)": f"version: {VERSION}",
}


@needs_ninja
@pytest.mark.parametrize("line", MISTAKES)
def test_a_mistake_is_told_when_the_project_is_configured(line: str, tmp_path: Path) -> None:
    project = Project("ninja", tmp_path / "mistaken")
    write_project(project.source, LISTS.partition("linkwise_add_robot")[0] + line)
    done = project.configure()
    assert done.returncode != 0
    assert MISTAKES[line] in " ".join(done.stderr.split())


@needs_ninja
@pytest.mark.parametrize(
    "version",
    [VERSION, f"{VERSION} EXACT", VERSION.partition(".")[0], f"{VERSION}.9"],
    ids=["this", "exactly this", "of this major", "a newer one"],
)
def test_this_version_or_an_older_one_may_be_asked_for(version: str, tmp_path: Path) -> None:
    project = Project("ninja", tmp_path / "asked")
    lists = LISTS.partition("linkwise_add_robot")[0]
    write_project(
        project.source, lists.replace("find_package(linkwise ", f"find_package(linkwise {version} ")
    )
    done = project.configure()
    assert (done.returncode == 0) == (version != f"{VERSION}.9"), done.stderr


@needs_ninja
def test_a_program_of_another_installation_is_refused(tmp_path: Path) -> None:
    project = Project("ninja", tmp_path / "other")
    write_project(project.source)
    other = tmp_path / "linkwise"
    other.write_text("#!/bin/sh\necho /somewhere/else\n")
    other.chmod(0o755)
    done = project.configure(f"-DLINKWISE_EXECUTABLE={other}")
    assert done.returncode != 0
    assert "is not of the installation in" in " ".join(done.stderr.split())


@needs_ninja
def test_without_the_program_it_is_told_what_lacks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folders = os.environ["PATH"].split(os.pathsep)
    monkeypatch.setenv("PATH", os.pathsep.join(f for f in folders if not (Path(f) / "linkwise").exists()))
    project = Project("ninja", tmp_path / "alone", program=tmp_path)
    write_project(project.source)
    done = project.configure()
    assert done.returncode != 0
    assert "the program linkwise is not in PATH; set LINKWISE_EXECUTABLE" in " ".join(done.stderr.split())
    optional = 'find_package(linkwise CONFIG)\nmessage(STATUS "found ${linkwise_FOUND}")'
    lists = LISTS.partition("find_package")[0] + optional
    (project.source / "CMakeLists.txt").write_text(lists)
    done = project.configure()
    assert (done.returncode, "found 0" in done.stdout) == (0, True), done.stderr


def test_linkwise_prints_the_folder_of_its_module() -> None:
    done = subprocess.run([PROGRAM, "--cmake-dir"], capture_output=True, text=True, check=True)
    assert Path(done.stdout.strip()).samefile(MODULE)
    assert (MODULE / "linkwise-config.cmake").is_file()
