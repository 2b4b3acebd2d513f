"""The emitted C where there is no operating system: what it calls, its stack, its size, and on a Cortex-M."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, PANDA, needs_compiler
from helpers.answers import random_states, relative_error
from helpers.call_graph import deepest
from helpers.compiled import Compiled, compile_library, name_of
from helpers.impedance_in_c import formula
from helpers.kept import run_kept
from helpers.needed import missing, needs
from linkwise import generate, read_system
from linkwise.package.manifest import Manifest
from tools import cortex_m

pytestmark = [pytest.mark.ship, needs_compiler]
CRANE, TURNTABLE, FOURBAR = str(DATA / "crane.urdf"), str(DATA / "turntable.py"), str(DATA / "fourbar.toml")
KINDS = {
    "straight": "puma560",
    "loops": f"{CRANE} loops",
    "parameters": "planar3 symbolic",
    "tied": FOURBAR,
    "energies": TURNTABLE,
}
"""Robots of every kind of file."""
WARNINGS = (
    *("-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wsign-conversion", "-Wfloat-conversion"),
    *("-Wdouble-promotion", "-Wshadow", "-Wcast-qual", "-Wcast-align", "-Wundef", "-Wvla"),
)
MATH = r"(?:_ZGV\w+_)?(?:sin|cos|sincos|sqrt|fabs|atan2|exp|log|pow|tan|tanh)f?"
"""Functions of math.h, also those of glibc for vectors, which come with -lm."""
CONTROL = (
    r"(pose|jacobian|jacobian_rate|mass_matrix|passive_torque|forward_dynamics|forward_dynamics_of_links|"
    r"partial_impedance|frame_partial_impedance|cancel)f?$"
)
SMALL = "-DLINKWISE_SMALL"
ARM = ("arm-none-eabi-gcc", "-std=c99", "-mthumb", "-mfloat-abi=hard", "-mcpu=cortex-m7", "-mfpu=fpv5-d16")
MADE = {"gcc": set(), "clang": {"memcpy", "memmove", "memset"}, ARM[0]: {"memcpy", "memset"}}
"""Functions that compilers themselves make calls of, with the flags below."""


def sources(directory: Path) -> list[Path]:
    return [directory / "c" / f"{name_of(directory)}{suffix}.c" for suffix in ("", "f")]


def needed(command: list[str], source: Path, made: Path) -> set[str]:
    """Compile, and return what the object asks of others."""
    run_kept([*command, "-c", source], made)
    nm = subprocess.run(["nm", "-u", str(made)], check=True, capture_output=True, text=True).stdout
    return {line.split()[-1] for line in nm.splitlines()}


@pytest.mark.parametrize("compiler", [("gcc",), ("clang",), ARM], ids=["gcc", "clang", "arm"])
@pytest.mark.parametrize("kind", KINDS)
def test_it_calls_the_functions_of_math_alone_and_converts_nothing_by_accident(
    kind: str, compiler: tuple[str, ...], directory_of: Callable[[str], Path], tmp_path: Path
) -> None:
    """Copies and zeros are excepted, of which compilers make calls themselves."""
    if lacking := missing(compiler[0]):
        pytest.skip(lacking)
    prototypes = ("-Wstrict-prototypes", "-Wmissing-prototypes")
    made = MADE[compiler[0]]
    for source in sources(directory_of(KINDS[kind])):
        single = source.stem != name_of(directory_of(KINDS[kind]))
        for flags in (("-Os", SMALL), ("-O1", "-ffreestanding")):
            command = [*compiler, "-std=c99", *WARNINGS, *prototypes, *flags]
            found = needed(command, source, tmp_path / "made.o") - made
            assert {name for name in found if not re.fullmatch(MATH, name)} == set(), flags
            floats = {name for name in found if name.endswith("f")}
            assert found == floats if single else not floats


@pytest.mark.parametrize("compiler", ["g++", "clang++"])
@pytest.mark.parametrize("kind", KINDS)
def test_as_cpp_it_converts_nothing_by_accident(
    kind: str, compiler: str, directory_of: Callable[[str], Path], tmp_path: Path
) -> None:
    if lacking := missing(compiler):
        pytest.skip(lacking)
    for source in sources(directory_of(KINDS[kind])):
        needed([compiler, "-x", "c++", "-std=c++17", *WARNINGS, "-O0", SMALL], source, tmp_path / "made.o")


def test_no_header_but_of_freestanding_c_and_math_is_included(directory_of: Callable[[str], Path]) -> None:
    for robot in KINDS.values():
        for path in (directory_of(robot) / "c").rglob("*.[ch]"):
            found = set(re.findall(r"#include <(.*)>", path.read_text(encoding="utf-8")))
            assert found <= {"math.h", "stddef.h", "float.h"}, path


def wrenches(model: Any, q: Any, qd: Any) -> tuple[Any, ...]:
    """Return the wrenches of links as C packs them, by what Python says of the last joint behind each."""
    k, j = model.layout.torque.T
    last = np.array([link.joint for link in model.backend.tree.links])
    found = model.reactions(q, qd, 0.0 * q + 1.0, axes="world")
    velocity = found.velocity[:, last[j], j, k] / qd[:, k, None]
    return found.acceleration[:, last[j], j, k], velocity, found.gravity[:, last, np.arange(model.N)]


@pytest.mark.parametrize("kind", [kind for kind in KINDS if kind != "parameters"])
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_one_by_one_it_says_what_numpy_says(
    kind: str,
    dtype: Any,
    directory_of: Callable[[str], Path],
    package_of: Callable[[str], ModuleType],
    tmp_path: Path,
) -> None:
    directory, model = directory_of(KINDS[kind]), package_of(KINDS[kind]).load("numpy")
    compile_library(directory, tmp_path / "small.so", ("gcc", "-std=c99", SMALL))
    library = Compiled(directory, library=tmp_path / "small.so")
    near = 1e-13 if dtype is np.float64 else 1e-5
    for count in (0, 1, 5):
        states = tuple(a.astype(dtype) for a in random_states(model.n, count))
        exact = tuple(a.astype(float) for a in states)
        packed = model.packed(*exact)
        for field, value in library.decomposition(*states).items():
            expected = getattr(packed, {"linear": "velocity_excess"}.get(field, field))
            assert relative_error(value, expected) <= near, (field, count)
        assert relative_error(library.torque(*states), packed.torque) <= near
        slopes = model.position_gradient(*exact)
        assert relative_error(library.position_gradient(*states), slopes[:, *model.layout.velocity.T]) <= near
        dense = {
            "partial_torque": (model.partial_torque(*exact),),
            "inverse_dynamics": (model.inverse_dynamics(*exact),),
            "propagation": model.propagation(*exact),
            "gradient_propagation": model.propagation(*exact, "gradient"),
            "coefficients": model.coefficients(*exact[:2]),
            "dense_position_gradient": (slopes,),
        }
        if kind != "energies":
            dense["regressor"] = (model.regressor(*exact),)
            dense["coefficient_regressors"] = model.coefficient_regressors(*exact[:2])
        if kind not in ("energies", "tied"):
            dense["reactions"] = wrenches(model, *exact[:2])
        for call, fields in dense.items():
            given = states[:2] if call.startswith(("coefficient", "reactions")) else states
            found = library.dense(call, given, [field.shape[1:] for field in fields])
            for one, other in zip(found, fields, strict=True):
                assert relative_error(one, other) <= near, (call, count)


def told(header: str) -> tuple[list[int], list[int]]:
    """Bytes of stack in double and float: of any function of one sample, and of those of motions."""
    text = re.sub(r"\s+", " ", header)
    number = r"([\d,]+)"
    found = re.search(
        rf"at most {number} bytes of stack in double and {number} in float, and those of torques, "
        rf"coefficients, gradients, regressors and reactions {number} and {number}\.",
        text,
    )
    assert found
    numbers = [int(n.replace(",", "")) for n in found.groups()]
    return numbers[:2], numbers[2:]


@pytest.mark.parametrize("compiler", [("gcc", "-std=c99"), ARM], ids=["x86", "arm"])
@pytest.mark.parametrize("kind", KINDS)
def test_no_path_of_calls_takes_more_stack_than_the_header_says(
    kind: str, compiler: tuple[str, ...], directory_of: Callable[[str], Path]
) -> None:
    if lacking := missing(compiler[0]):
        pytest.skip(lacking)
    directory = directory_of(KINDS[kind])
    header = (directory / "c" / f"{name_of(directory)}.h").read_text(encoding="utf-8")
    every, motions = told(header)
    for level in ("-O2", "-Os"):
        for number, source in enumerate(sources(directory)):
            paths = deepest([*compiler, level, SMALL], source)
            most = {name: size for name, size in paths.items() if not re.search(CONTROL, name)}
            assert max(most.values()) <= motions[number], (level, source.name)
            assert 0.2 * every[number] <= max(paths.values()) <= every[number], (level, source.name)
    blocks = int(re.findall(r"of which none takes\s+more than ([\d,]+) bytes", header)[0].replace(",", ""))
    assert max(deepest([*compiler, "-O2"], sources(directory)[0]).values()) <= blocks


needs_board = needs(*cortex_m.TOOLS)


@needs_board
@pytest.mark.parametrize(("processor", "real"), [("M4F", "float"), ("M7", "double")])
@pytest.mark.parametrize("robot", ["puma560", str(PANDA)], ids=["straight", "panda"])
def test_on_a_cortex_m_it_says_what_pinocchio_and_numpy_say(
    robot: str,
    processor: str,
    real: str,
    directory_of: Callable[[str], Path],
    package_of: Callable[[str], ModuleType],
) -> None:
    if robot == str(PANDA) and not PANDA.is_file():
        pytest.skip("needs the package example-robot-data")
    kind = f"{robot} loops" if robot == str(PANDA) else robot
    directory, model = directory_of(kind), package_of(kind).load("numpy")
    near, dtype = (1e-5, np.float32) if real == "float" else (1e-12, np.float64)
    motion = np.stack(random_states(model.n, cortex_m.SAMPLES)).astype(dtype).astype(float)
    functions = cortex_m.calls(model.n, model.N)
    found = cortex_m.run(directory, cortex_m.BOARDS[processor], real, motion, functions)
    header = (directory / "c" / f"{name_of(directory)}.h").read_text(encoding="utf-8")
    every, motions = (numbers[real == "float"] for numbers in told(header))
    assert set(found) == set(functions)
    inertia = 0.5 * np.eye(model.n)
    wanted = {"inertia": inertia, "damping": inertia, "stiffness": inertia}
    expected = {
        "inverse_dynamics": model.inverse_dynamics(*motion),
        "partial_torque": model.partial_torque(*motion),
        "propagation": np.concatenate([a.reshape(len(a), -1) for a in model.propagation(*motion)], 1),
        "mass_matrix": model.mass_matrix(motion[0]),
        "forward_dynamics": model.forward_dynamics(*motion),
        "partial_impedance": np.array(
            [
                formula(model, q, qd, wanted, (qdd, qd, qdd), None, None)[1]
                for q, qd, qdd in motion.swapaxes(0, 1)
            ]
        ),
    }
    if robot == str(PANDA):
        expected["inverse_dynamics"] = pinocchio_says(motion)
    for name, measured in found.items():
        values = expected[name].reshape(cortex_m.SAMPLES, -1)
        slack = 1e3 if name in ("forward_dynamics", "partial_impedance") else 1.0
        assert relative_error(measured.values, values) <= slack * near, name
        # What math.h's functions take comes on top.
        assert measured.stack <= (every if re.search(CONTROL, name) else motions) + 600, name
        assert 500 < measured.instructions < 100_000


def pinocchio_says(motion: Any) -> Any:
    """Torques of Panda with its fingers held."""
    pin = pytest.importorskip("pinocchio", reason="needs pinocchio: pip install pin")
    whole = pin.buildModelFromUrdf(str(PANDA))
    fingers = [whole.getJointId(f"panda_finger_joint{k}") for k in (1, 2)]
    model = pin.buildReducedModel(whole, fingers, pin.neutral(whole))
    data = model.createData()
    return np.array([pin.rnea(model, data, q, qd, qdd) for q, qd, qdd in motion.swapaxes(0, 1)])


@needs("arm-none-eabi-gcc")
@pytest.mark.parametrize("robot", [*KINDS.values(), "puma560 loops", "torso", "planar10", "planar80 loops"])
def test_the_manifests_size_is_what_the_compiler_makes_to_a_fifth(
    robot: str, directory_of: Callable[[str], Path]
) -> None:
    size = Manifest.read(directory_of(robot)).code_size
    assert size is not None
    flags = ("-Os", SMALL)
    double = cortex_m.flash(directory_of(robot), "double", cortex_m.BOARDS["M7"], flags)
    single = cortex_m.flash(directory_of(robot), "float", cortex_m.BOARDS["M4F"], flags)
    assert size.float64 == pytest.approx(double, rel=0.2)
    assert size.float32 == pytest.approx(single, rel=0.2)


def test_without_c_there_is_no_size() -> None:
    files = generate(read_system("planar2"), ["numpy"])
    assert json.loads(files["manifest.json"])["code_size"] is None


TIDY = "-*,clang-analyzer-*,bugprone-*,cert-*,-bugprone-easily-swappable-parameters"
WIDENING = "-bugprone-implicit-widening-of-multiplication-result"
"""Off: products of indices, which no robot is large enough for to pass an int."""
ANALYSERS = {
    "cppcheck": (
        *(
            "cppcheck",
            "-q",
            "--std=c99",
            "--error-exitcode=1",
            "--enable=warning,style,performance,portability",
        ),
        *("--suppress=unusedStructMember", "--suppress=missingIncludeSystem", SMALL),
    ),
    "clang-tidy": ("clang-tidy", "--quiet", f"-checks={TIDY},{WIDENING}", "-warnings-as-errors=*"),
}


@pytest.mark.parametrize("tool", ANALYSERS)
@pytest.mark.parametrize("kind", KINDS)
def test_analysers_find_nothing(kind: str, tool: str, directory_of: Callable[[str], Path]) -> None:
    if lacking := missing(tool):
        pytest.skip(lacking)
    source = sources(directory_of(KINDS[kind]))[0]
    for defined in ((), ("-DLINKWISE_FLOAT",)):
        tail = ("--", "-std=c99", SMALL, *defined) if tool == "clang-tidy" else defined
        run_kept([*ANALYSERS[tool], source, *tail])


def test_the_example_of_the_docs_runs(package_of: Callable[[str], ModuleType], tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "embedded.md").read_text(encoding="utf-8")
    [main] = re.findall(r"```c main.c\n(.*?)```", text, flags=re.DOTALL)
    (tmp_path / "main.c").write_text(main, encoding="utf-8")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    for command in re.findall(r"```sh\n(.*?)```", text, flags=re.DOTALL):
        done = subprocess.run(
            ["sh", "-e", "-c", command],
            cwd=tmp_path,
            env=os.environ | {"PATH": path},
            check=True,
            capture_output=True,
            text=True,
        )
    holds, springs = map(float, re.findall(r"-?\d+\.\d+", done.stdout))
    model = package_of("puma560").load("numpy")
    q = np.array([0.1, -0.5, 0.8, 0.0, 0.3, 0.0])
    assert holds == pytest.approx(model.gravity_torque(q)[1], abs=0.01)
    assert springs == pytest.approx(-40 * -0.5, abs=0.01)
