"""The emitted C needs no compiler's extension; compiled for Windows it says under Wine what NumPy says."""

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType

import linkwise
import numpy as np
import pytest
from conftest import needs_compiler
from helpers.answers import random_states, relative_error
from helpers.compiled import name_of
from helpers.kept import run_kept
from helpers.needed import needs
from linkwise_runtime.native.build import PARTS
from linkwise_runtime.native.compiler import FLAGS, MinGW

pytestmark = pytest.mark.ship

PROGRAM = Path(__file__).parents[1] / "helpers/answers.c"
CMAKE = Path(linkwise.__file__).parent / "cmake"
LINKWISE = Path(sys.executable).with_name("linkwise")
SAMPLES = 37
MINGW, OBJDUMP = (f"x86_64-w64-mingw32-{tool}" for tool in ("gcc", "objdump"))
WINE = shutil.which("wine64", path=os.pathsep.join([os.environ["PATH"], "/usr/lib/wine"]))
STRICT = ("-std=c99", "-pedantic-errors", "-Wall", "-Wextra", "-Werror", "-O1")
needs_mingw = pytest.mark.skipif(
    shutil.which(MINGW) is None or WINE is None, reason="needs gcc of MinGW-w64, and Wine"
)
ROBOTS = ("planar3", "puma560 loops")

PLAIN = {
    "math.h": """
double sin(double), cos(double), sqrt(double), fabs(double), atan2(double, double), pow(double, double);
float sinf(float), cosf(float), sqrtf(float), fabsf(float), atan2f(float, float), powf(float, float);
#define HUGE_VAL ((double)((float)(1e+300 * 1e+300)))
""",
    "float.h": """
#define DBL_EPSILON 2.2204460492503131e-016
#define FLT_EPSILON 1.192092896e-07F
""",
    "stddef.h": """
#ifndef SIZE
#define SIZE
#ifdef _WIN64
typedef unsigned long long size_t;
#else
typedef unsigned long size_t;
#endif
#define NULL ((void *)0)
#endif
""",
    "string.h": """
#include <stddef.h>
void *memcpy(void *, const void *, size_t), *memset(void *, int, size_t);
""",
}
"""All that the emitted C may want of a C library, much as Microsoft's says it."""


@dataclass(frozen=True)
class Robot:
    """A package, and the folder where its C is compiled and its answers are written."""

    package: ModuleType
    directory: Path
    folder: Path
    real: str = "double"
    run: tuple[str, ...] = ()
    environment: dict[str, str] = field(default_factory=dict)

    @property
    def name(self) -> str:
        return name_of(self.directory)

    @property
    def source(self) -> Path:
        return self.directory / "c" / f"{self.name}{'f' if self.real == 'float' else ''}.c"

    @property
    def dtype(self) -> type:
        return np.float64 if self.real == "double" else np.float32

    def main(self) -> list[str | Path]:
        """Return what compiles answers.c for this robot."""
        constants = {key: f"{self.name.upper()}_{key}" for key in ("JOINTS", "LINKS", "C2", "C1", "G")}
        call = f"{self.name}_##name{'##f' if self.real == 'float' else ''}"
        given = {"HEADER": f'"{self.name}.h"', "SAMPLES": SAMPLES, "real": self.real, "CALL(name)": call}
        return [
            *(f"-D{k}={v}" for k, v in (constants | given).items()),
            f"-I{self.source.parent}",
            "-c",
            PROGRAM,
        ]

    def compile(self, *command: str | Path, to: str | None = None) -> None:
        """Run a compiler, with `-o` of a file in the folder; fail where it does."""
        run_kept(command, None if to is None else self.folder / to, self.folder)

    def command(self, *command: str) -> str:
        """Return what a command prints; fail where it does."""
        done = subprocess.run(
            command,
            cwd=self.folder,
            env=os.environ | self.environment,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == 0, (command, done.stderr, done.stdout)
        return done.stdout

    def says_what_numpy_says(self, program: str) -> None:
        """Run a program of answers.c, and hold all that it answers against NumPy."""
        model = self.package.load("numpy")
        states = tuple(m.astype(self.dtype) for m in random_states(model.n, SAMPLES))
        (self.folder / "motion.bin").write_bytes(b"".join(m.tobytes() for m in states))
        (self.folder / "answer.bin").unlink(missing_ok=True)
        self.command(*self.run, str(self.folder / program))
        q, qd, qdd = (m.astype(float) for m in states)
        packed = model.packed(q, qd, qdd)
        expected = (
            *(packed.acceleration, packed.velocity, packed.gravity, packed.torque),
            model.inverse_dynamics(q, qd, qdd),
            model.position_gradient(q, qd, qdd),
            model.mass_matrix(q[0]),
        )
        given = np.frombuffer((self.folder / "answer.bin").read_bytes(), self.dtype)
        ends = np.cumsum([part.size for part in expected])
        assert given.size == ends[-1]
        for found, part in zip(np.split(given, ends[:-1]), expected, strict=True):
            bound = 1e-13 if self.real == "double" else 1e-5
            assert relative_error(found.reshape(len(part), -1), part.reshape(len(part), -1)) <= bound


Make = Callable[..., Robot]


@pytest.fixture
def robot_of(
    directory_of: Callable[[str], Path], package_of: Callable[[str], ModuleType], tmp_path: Path
) -> Make:
    """A robot of `ROBOTS` in a folder of its own."""

    def make(name: str, real: str = "double", **how: object) -> Robot:
        return Robot(package_of(name), directory_of(name), tmp_path, real, **how)  # type: ignore[arg-type]

    return make


@pytest.fixture(scope="module")
def wine(tmp_path_factory: pytest.TempPathFactory) -> Iterator[dict[str, object]]:
    """Return how Windows' programs are run; the folder that Wine makes for it is large, and goes in the
    end."""
    place = tmp_path_factory.mktemp("wine")
    settings = {"WINEPREFIX": str(place / "prefix"), "WINEDEBUG": "-all"}
    settings["WINEDLLOVERRIDES"] = "mscoree,mshtml,winemenubuilder.exe="
    yield {"run": (str(WINE),), "environment": settings}
    server = shutil.which("wineserver64", path=str(Path(str(WINE)).parent))
    if server is not None:
        subprocess.run([server, "-k"], env=os.environ | settings, capture_output=True, check=False)
    shutil.rmtree(place, ignore_errors=True)


@needs_mingw
@pytest.mark.parametrize("name", ROBOTS)
def test_a_program_for_windows_says_what_numpy_says_in_float(
    name: str, robot_of: Make, wine: dict[str, object]
) -> None:
    robot = robot_of(name, "float", **wine)
    robot.compile(MINGW, *STRICT, "-c", robot.source, to="robot.o")
    robot.compile(MINGW, *STRICT, *robot.main(), to="main.o")
    robot.compile(MINGW, "-static", "main.o", "robot.o", to="main.exe")
    robot.says_what_numpy_says("main.exe")


@needs_mingw
@pytest.mark.parametrize("name", ROBOTS)
def test_the_library_that_native_would_make_on_windows_says_what_numpy_says(
    name: str, robot_of: Make, wine: dict[str, object]
) -> None:
    robot, compiler = robot_of(name, **wine), MinGW((MINGW,))
    parts = sorted({part for library in PARTS.values() for part in library})
    for part in parts:
        *compiling, _, made = compiler.compiling(robot.source, part, f"{part}.o")
        robot.compile(*compiling, "-Werror", to=made)
    *linking, _, made = compiler.linking([f"{part}.o" for part in parts], "native.dll")
    robot.compile(*linking, to=made)
    needed = set(re.findall(r"DLL Name: (\S+)", robot.command(OBJDUMP, "-p", "native.dll")))
    assert needed <= {"KERNEL32.dll", "msvcrt.dll"}  # Python looks for no others beside it
    robot.compile(MINGW, *STRICT, *robot.main(), to="main.o")
    robot.compile(MINGW, "main.o", "native.dll", "-static", to="main.exe")
    robot.says_what_numpy_says("main.exe")


LISTS = """cmake_minimum_required(VERSION 3.20)
project(controller LANGUAGES C)
find_package(linkwise CONFIG REQUIRED)
linkwise_add_robot(planar3 ROBOT planar3 SHARED)
add_executable(main answers.c)
target_compile_options(main PRIVATE {defined})
target_link_libraries(main PRIVATE planar3)
"""


@needs_mingw
@needs("cmake", "ninja")
def test_cmake_makes_a_library_and_a_program_for_windows(robot_of: Make, wine: dict[str, object]) -> None:
    robot = robot_of("planar3", **wine)
    shutil.copy(PROGRAM, robot.folder)
    defined = " ".join(f"[==[{word}]==]" for word in robot.main() if str(word).startswith("-D"))
    (robot.folder / "CMakeLists.txt").write_text(LISTS.format(defined=defined), encoding="utf-8")
    toolchain = ("-DCMAKE_SYSTEM_NAME=Windows", f"-DCMAKE_C_COMPILER={MINGW}")
    linkwise = (f"-Dlinkwise_DIR={CMAKE}", f"-DLINKWISE_EXECUTABLE={LINKWISE}")
    robot.command("cmake", "-G", "Ninja", "-S", ".", "-B", ".", *toolchain, *linkwise)
    robot.command("cmake", "--build", ".")
    robot.says_what_numpy_says("main.exe")


@pytest.fixture
def plain(tmp_path: Path) -> Path:
    """Headers of no compiler in particular."""
    folder = tmp_path / "plain"
    folder.mkdir()
    for name, text in PLAIN.items():
        (folder / name).write_text(text, encoding="ascii")
    return folder


@needs_compiler
@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("name", ROBOTS)
def test_without_any_extension_it_says_what_numpy_says(
    name: str, real: str, robot_of: Make, plain: Path
) -> None:
    """gcc, whose headers stay away, denies being gcc: what is left to the other compilers is compiled."""
    robot = robot_of(name, real)
    denied = ("-U__GNUC__", "-fno-asm", "-nostdinc", f"-I{plain}")
    robot.compile("gcc", *STRICT, *denied, "-c", robot.source, to="robot.o")
    robot.compile("gcc", *STRICT, *robot.main(), to="main.o")
    robot.compile("gcc", "main.o", "robot.o", "-lm", to="main")
    robot.says_what_numpy_says("main")


@needs("clang")
@pytest.mark.parametrize("real", ["double", "float"])
@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize(
    "options",
    [
        pytest.param(("-fsyntax-only", "-nostdinc", *STRICT, "-I"), id="clang"),
        pytest.param(("--driver-mode=cl", "/c", "/X", "/W4", "/WX", "/Forobot.obj", "/I"), id="clang-cl"),
    ],
)
def test_it_compiles_for_microsofts_linker_without_a_warning(
    options: Sequence[str], name: str, real: str, robot_of: Make, plain: Path
) -> None:
    robot = robot_of(name, real)
    target = "--target=x86_64-pc-windows-msvc"
    *options, include = options
    robot.compile("clang", target, *options, f"{include}{plain}", robot.source)


def test_flags_of_windows_have_nothing_of_one_processor() -> None:
    """gcc there counts on a stack for vectors of AVX that Windows does not align so."""
    assert MinGW(("gcc",)).flags == FLAGS
