"""Functions of the emitted C that control needs, of one sample: frames, mass matrix and forward dynamics."""

import ctypes
import json
import re
import subprocess
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
from conftest import DATA, needs_compiler
from helpers.answers import random_states, relative_error
from helpers.compiled import WARNED, compile_library, name_of
from helpers.kept import run_kept
from helpers.urdf_text import joint, link, robot
from linkwise import Options, generate, read_system, write_package
from linkwise.check.compiled_c import declarations
from linkwise.package.load import import_package
from linkwise_runtime.certainty.uncertain_bodies import UncertainBodies
from linkwise_runtime.targets import ROWS
from runtime.test_passive_torque import HAND

from emit.test_emitted_c import COMPILERS, strict

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
KINDS = {
    "curved": f"{DATA / 'knee.osim'} loops",
    "following": f"{CRANE} loops",
    "parameters": "planar3 symbolic",
    "energies": str(DATA / "turntable.py"),
}
GEAR = '[[constraint]]\nname = "gear"\ntype = "coupling"\nterms = { a = 1, c = -2 }\n'


@pytest.mark.parametrize("robot", ["torso", f"{CRANE} loops"], ids=["straight", "loops"])
@pytest.mark.parametrize("compiler", COMPILERS)
def test_a_program_asks_for_frames_by_name(
    robot: str,
    compiler: str,
    directory_of: Callable[[str], Path],
    package_of: Callable[[str], ModuleType],
    tmp_path: Path,
) -> None:
    """The program has nothing but the header, and NAME.c beside it, as a user writes it."""
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
    made, source = tmp_path / "main", directory / "c" / f"{name}.c"
    run_kept([command, *flags, *WARNED, f"-I{directory / 'c'}", program, source, "-lm"], made)
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


@pytest.mark.parametrize("kernel", ["straight", "loops"])
def test_a_wrist_is_as_singular_beside_another_arm(kernel: str, tmp_path: Path) -> None:
    """A wrist is as nearly singular beside another arm; the joint of the other arm comes first."""
    arm = [link("arm"), joint("lift", "base", "arm", **ROLL)]
    first = WRIST.index("<joint")
    path = tmp_path / "wrist.urdf"
    path.write_text("\n".join([WRIST[:first], *arm, WRIST[first:]]), encoding="utf-8")
    write_package(generate(read_system(path), ["c"], kernel=kernel), tmp_path / "wrist")
    compile_library(tmp_path / "wrist", tmp_path / "wrist.so")
    library = ctypes.CDLL(str(tmp_path / "wrist.so"))
    function = getattr(library, f"{name_of(tmp_path / 'wrist')}_forward_dynamics")
    names = [coordinate.name for coordinate in read_system(path).coordinates]
    assert names == ["lift", "roll", "pitch", "turn"]
    qd, tau, qdd = np.zeros((3, 4))
    for q in np.random.default_rng(1).uniform(-3.0, 3.0, (30, 4)):
        for pitch, number in ((0.5, 0), (1e-6, -4), (0.0, 4), (np.pi, 4), (np.pi - 1e-6, -4)):
            q[2] = pitch
            assert function(*(ctypes.c_void_p(a.ctypes.data) for a in (q, qd, tau, qdd))) == number


def test_native_names_the_joints_that_move_no_mass(tmp_path: Path) -> None:
    path = tmp_path / "wrist.urdf"
    path.write_text(WRIST, encoding="utf-8")
    write_package(generate(read_system(path), kernel="loops"), tmp_path / "wrist")
    wrist, rest = import_package(tmp_path / "wrist").load("native"), np.zeros(3)
    with pytest.raises(ValueError, match="singular: the joints roll, turn can move together without moving"):
        wrist.forward_dynamics(rest, rest, rest)
    assert np.isnan(wrist.forward_dynamics(rest + np.nan, rest, rest)).all()


def test_where_a_sliding_base_is_does_not_matter(tmp_path: Path) -> None:
    """The mass matrix and accelerations of a body that floats are those at the origin, to the last bit."""
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


CONTROLLERS = {"partial_impedance", "frame_partial_impedance", "cancel"}
ANY = {(0, 0, 0, 1)}
FREE = {"forward_dynamics", "forward_dynamics_of_links"}
"""Calls that move joints that nothing ties."""
TIED_OF_PASSIVE = {"constrained_response_of_links", "constrained_dynamics_of_links"}
OF_PASSIVE = {"forward_dynamics_of_links", "passive_torque", *TIED_OF_PASSIVE}
"""Calls that only robots have a use for whose joints have anything of their own."""


@pytest.fixture(scope="module")
def kinds(directory_of: Callable[[str], Path], tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """A package of each kind of robot."""
    made, folder = (
        {kind: directory_of(robot) for kind, robot in KINDS.items()},
        tmp_path_factory.mktemp("kinds"),
    )
    tied = (DATA / "fourbar.toml").read_text()
    for kind, file, text in (
        ("tied", "tied.toml", tied),
        ("coupled", "coupled.toml", tied.partition("[[constraint]]")[0] + GEAR),
        ("passive", "passive.urdf", HAND),
        (
            "tied and passive",
            "both.toml",
            tied.replace('child = "rocker"', 'child = "rocker", armature = 0.1'),
        ),
    ):
        (folder / file).write_text(text, encoding="utf-8")
        made[kind] = folder / kind.replace(" ", "_")
        write_package(generate(read_system(folder / file), ["c", "numpy"], kernel="loops"), made[kind])
    return made


def in_python(package: ModuleType, robot: Any) -> dict[str, Callable[[], Any]]:
    """Return the call of Python that answers as each function of C does."""
    q = 0.3 + 0.1 * np.arange(robot.n)
    frame = robot.link_names[-1]

    def of_frame() -> Any:
        row = ROWS[np.abs(robot.kinematics.jacobian(q, frame)).max(1).argmax()]
        return robot.partial_impedance(frame=package.FrameImpedance(frame, rows=(row,)))(q, q)

    return {
        "decomposition": lambda: robot.packed(q, q, q),
        "decomposition_blocks": lambda: robot.packed(q, q, q),
        "torque": lambda: robot.packed(q, q, q),
        "partial_torque": lambda: robot.partial_torque(q, q, q),
        "inverse_dynamics": lambda: robot.inverse_dynamics(q, q, q),
        "coefficients": lambda: robot.coefficients(q, q),
        "propagation": lambda: robot.propagation(q, q, q),
        "gradient_propagation": lambda: robot.propagation(q, q, q, convention="gradient"),
        "position_gradient": lambda: robot.position_gradient(q, q, q),
        "dense_position_gradient": lambda: robot.position_gradient(q, q, q),
        "regressor": lambda: robot.regressor(q, q, q),
        "coefficient_regressors": lambda: robot.coefficient_regressors(q, q),
        "share_variances": lambda: robot.uncertainty(q, q, q, UncertainBodies(0.1)),
        "motion_variances_blocks": lambda: robot.uncertainty(q, q, q, motion=np.eye(3 * robot.n)),
        "reactions": lambda: robot.reactions(q, q, q, constraints=False),
        "pose": lambda: robot.kinematics.pose(q, frame),
        "jacobian": lambda: robot.kinematics.jacobian(q, frame),
        "jacobian_rate": lambda: robot.kinematics.jacobian_rate(q, q, frame),
        "mass_matrix": lambda: robot.mass_matrix(q),
        "passive_torque": lambda: robot.passive_torque(q, q, q),
        "forward_dynamics": lambda: robot.forward_dynamics(q, q, q),
        "forward_dynamics_of_links": lambda: robot.forward_dynamics(q, q, q, passive=False),
        "partial_impedance": lambda: robot.partial_impedance()(q, q),
        "frame_partial_impedance": of_frame,
        "cancel": lambda: robot.cancel(ANY)(q, q, qdd=q),
        "simulate": lambda: robot.kinematics and robot.simulate(q, q, [0.0, 1e-3], constraints=False),
        **of_ties(package, robot, q),
    }


def of_tied_frame(package: ModuleType, robot: Any, ties: Any, q: Any) -> Any:
    """Return torques for the row of any frame along which ties let it move most."""
    moved = {
        name: np.abs(robot.kinematics.jacobian(q, name) @ ties.velocity_map(q)).max(1)
        for name in robot.link_names
    }
    frame = max(moved, key=lambda name: float(moved[name].max()))
    row = package.FrameImpedance(frame, rows=(ROWS[moved[frame].argmax()],))
    return robot.partial_impedance(frame=row, constraints=ties)(q, q)


def of_ties(package: ModuleType, robot: Any, q: Any) -> dict[str, Callable[[], Any]]:
    """Return the same of functions of tied joints; a robot without ties is held at a point.

    An arm so short that it cannot move then is left out.
    """
    ties, at = (robot.constraints, None) if robot.backend.ties_joints else (None, q)
    for name in reversed(robot.link_names if ties is None else ()):
        with suppress(ValueError):
            ties = robot.constrained(contacts=[package.Contact(name, "point", (0.1, 0.2, 0.3))], at=q)
            break

    place = ties.closed_position if ties is not None and at is None else q

    def on(call: str, given: int, **named: Any) -> Callable[[], Any]:
        return lambda: ties and getattr(ties, call)(place, *[q] * (given - 1), **named)

    return {
        "constraint_rows": on("jacobian_rate", 2),
        "closed": on("closed", 1),
        "following": on("velocity_accelerations", 2),
        "constrained_coefficients": on("coefficients", 2),
        "constrained_propagation": on("propagation", 3),
        "constrained_torque": on("partial_torque", 3),
        "constrained_response": on("forward_dynamics", 3),
        "constrained_response_of_links": on("forward_dynamics", 3, passive=False),
        "constrained_dynamics": on("forward_dynamics", 3),
        "constrained_dynamics_of_links": on("forward_dynamics", 3, passive=False),
        "constrained_partial_impedance": lambda: ties and robot.partial_impedance(constraints=ties)(place, q),
        "constrained_frame_partial_impedance": lambda: ties and of_tied_frame(package, robot, ties, place),
        "constrained_cancel": lambda: ties and robot.cancel(ANY, constraints=ties)(place, q, qdd=q),
        "contacts_keep": lambda: ties and robot.partial_impedance(constraints=ties).forces(place, q),
    }


@pytest.mark.parametrize("kind", [*KINDS, "tied", "coupled", "passive", "tied and passive"])
def test_c_offers_nothing_that_python_refuses(kind: str, kinds: dict[str, Path]) -> None:
    """C names what it lacks; that what it offers answers as Python does is what check holds."""
    name, package = name_of(kinds[kind]), import_package(kinds[kind])
    robot = package.load("numpy")
    header = (kinds[kind] / "c" / f"{name}.h").read_text(encoding="utf-8")
    functions = {function.removeprefix(f"{name}_") for function in declarations(name, header)}
    offered = {function for function in functions if not re.fullmatch(r"link_\d+f?|.*f", function)}
    assert functions == {of + end for of in offered for end in ("", "f")} | {
        f"link_{j + 1}{end}" for j in range(robot.N) for end in ("", "f")
    }
    calls, refused = in_python(package, robot), set()
    assert offered <= calls.keys(), "a new function of C is held against a call in Python"
    for function, call in calls.items():
        try:
            call()
        except ValueError:
            refused.add(function)
    assert not offered & refused
    tied = "tied" in kind or kind == "coupled"
    assert FREE & calls.keys() <= refused if tied else not {"forward_dynamics", "partial_impedance"} & refused
    if robot.backend.tree is not None:  # of energies C has less
        lacking = set() if robot.structure.passive else OF_PASSIVE
        lacking |= {"reactions", *CONTROLLERS} if tied else set()
        assert offered == calls.keys() - refused - lacking
    told = [
        f"There is no {name}_forward_dynamics",
        "which functions of tied joints",
        "'gear'" if kind == "coupled" else "'pin'",
    ]
    assert [words in header for words in told] == [tied] * 3
