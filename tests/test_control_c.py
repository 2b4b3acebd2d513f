"""Functions of the emitted C that control needs, of one sample: frames, mass matrix and forward dynamics."""

import ctypes
import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from answers import random_states, relative_error
from compiled import WARNED, compile_library, name_of
from conftest import DATA, needs_compiler
from linkwise import Options, generate, read_system, write_package
from linkwise.package.load import import_package
from test_emitted_c import COMPILERS, strict
from urdf_text import joint, link, robot

pytestmark = needs_compiler
CRANE = str(DATA / "crane.urdf")
ROLL = {"xyz": "0 0 0", "rpy": "0 0 0", "axis": "0 0 1"}
WRIST = robot(
    link("base"),
    '<link name="fork"/><link name="cross"/>',
    link("hand"),
    joint("roll", "base", "fork", **ROLL),
    joint("pitch", "fork", "cross", **(ROLL | {"axis": "0 1 0"})),
    joint("turn", "cross", "hand", **ROLL),
)
"""Three axes through a point, and mass behind the last alone."""


@pytest.mark.parametrize("robot", ["torso", f"{CRANE} loops"], ids=["straight", "loops"])
@pytest.mark.parametrize("compiler", COMPILERS)
def test_a_program_asks_for_frames_by_name(
    robot: str,
    compiler: str,
    directory_of: Callable[[str], Path],
    package_of: Callable[[str], ModuleType],
    tmp_path: Path,
) -> None:
    """As a user writes it: nothing but the header, and NAME.c beside it."""
    directory, (command, *flags) = directory_of(robot), strict(compiler)
    name, model = name_of(directory), package_of(robot).load("numpy")
    frame = model.kinematics.frames[-1]
    q, qd, tau = (0.1 + 0.05 * np.arange(model.n) * factor for factor in (1, -2, 3))
    numbers = [f"{{{', '.join(map(repr, row.tolist()))}}}" for row in (q, qd, tau)]
    program = tmp_path / "main.c"
    program.write_text(
        f"""#include "{name}.h"
#include <stdio.h>
enum {{ N = {name.upper()}_JOINTS, TOOL = {name.upper()}_FRAME_{frame} }};
static void print(int count, const double *numbers)
{{
    for (int i = 0; i < count; ++i)
        printf("%.17g ", numbers[i]);
}}
int main(void)
{{
    const double q[N] = {numbers[0]}, qd[N] = {numbers[1]}, tau[N] = {numbers[2]};
    const double point[3] = {{0.1, 0.2, -0.3}};
    double pose[16], jacobian[6 * N], rate[6 * N], mass[N * N], qdd[N];
    {name}_pose(TOOL, q, pose);
    {name}_jacobian(TOOL, point, q, jacobian);
    {name}_jacobian_rate(TOOL, NULL, q, qd, rate);
    {name}_mass_matrix(q, mass);
    if ({name}_forward_dynamics(q, qd, tau, qdd))
        return 1;
    print(16, pose), print(6 * N, jacobian), print(6 * N, rate), print(N * N, mass), print(N, qdd);
    return 0;
}}
""",
        encoding="utf-8",
    )
    made, source = str(tmp_path / "main"), str(directory / "c" / f"{name}.c")
    including = f"-I{directory / 'c'}"
    subprocess.run([command, *flags, *WARNED, including, str(program), source, "-lm", "-o", made], check=True)
    printed = subprocess.run([made], check=True, capture_output=True, text=True).stdout
    expected = (
        model.kinematics.pose(q, frame),
        model.kinematics.jacobian(q, frame, [0.1, 0.2, -0.3]),
        model.kinematics.jacobian_rate(q, qd, frame),
        model.mass_matrix(q),
        model.forward_dynamics(q, qd, tau),
    )
    found = np.array(printed.split(), float)
    for value in expected:
        assert relative_error(found[: value.size], value.ravel()) <= 1e-12
        found = found[value.size :]
    assert not found.size


@pytest.mark.parametrize("kernel", ["straight", "loops"])
def test_forward_dynamics_says_which_joint_moves_no_mass(kernel: str, tmp_path: Path) -> None:
    path = tmp_path / "wrist.urdf"
    path.write_text(WRIST, encoding="utf-8")
    write_package(generate(read_system(path), ["c"], kernel=kernel), tmp_path / "wrist")
    compile_library(tmp_path / "wrist", tmp_path / "wrist.so")
    function = getattr(
        ctypes.CDLL(str(tmp_path / "wrist.so")), f"{name_of(tmp_path / 'wrist')}_forward_dynamics"
    )

    def answer(*motion: np.ndarray) -> tuple[int, np.ndarray]:
        qdd = np.full(3, 7.0)
        return function(*(ctypes.c_void_p(a.ctypes.data) for a in (*motion, qdd))), qdd

    q, qd, tau = (np.array(row) for row in ([0.3, 0.5, 0.2], [0.1, 0.2, 0.3], [1.0, 2.0, 3.0]))
    number, qdd = answer(q, qd, tau)
    assert number == 0
    assert np.isfinite(qdd).all()
    assert (qdd != 7.0).all()
    for pitch, first in ((0.0, 3), (np.nan, 1)):
        q[1] = pitch
        number, qdd = answer(q, qd, tau)
        assert number == first
        assert (qdd == 7.0).all()


def test_native_names_the_joints_that_move_no_mass(tmp_path: Path) -> None:
    path = tmp_path / "wrist.urdf"
    path.write_text(WRIST, encoding="utf-8")
    write_package(generate(read_system(path), kernel="loops"), tmp_path / "wrist")
    wrist, rest = import_package(tmp_path / "wrist").load("native"), np.zeros(3)
    with pytest.raises(ValueError, match="singular: the joints roll, turn can move together without moving"):
        wrist.forward_dynamics(rest, rest, rest)
    assert np.isnan(wrist.forward_dynamics(rest + np.nan, rest, rest)).all()


def test_where_a_sliding_base_is_does_not_matter(tmp_path: Path) -> None:
    """Of a body that floats, the mass matrix and accelerations are those at the origin, to the last bit."""
    write_package(
        generate(read_system(CRANE, Options(base="floating")), ["c"], kernel="loops"), tmp_path / "crane"
    )
    compile_library(tmp_path / "crane", tmp_path / "crane.so")
    library = ctypes.CDLL(str(tmp_path / "crane.so"))
    n = len(json.loads((tmp_path / "crane" / "manifest.json").read_text())["joints"])
    q, qd, tau = (rows[0].copy() for rows in random_states(n, 1))
    answers = []
    for away in (0.0, 1e6):
        q[:3] += away
        mass, qdd = np.full((n, n), np.nan), np.full(n, np.nan)
        library.crane_mass_matrix(*(ctypes.c_void_p(a.ctypes.data) for a in (q, mass)))
        assert not library.crane_forward_dynamics(
            *(ctypes.c_void_p(a.ctypes.data) for a in (q, qd, tau, qdd))
        )
        answers.append((mass, qdd))
    for here, there in zip(*answers, strict=True):
        assert (here == there).all()
