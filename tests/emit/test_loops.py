"""A kernel in loops: it answers as the closed forms do, for robots of every kind, and is chosen by size."""

import ctypes
import json
import re
import shutil
import subprocess
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from conftest import DATA, needs_compiler
from helpers.answers import random_states, relative_error
from helpers.compiled import Compiled, check_syntax, compile_library, library_of, link_parts, name_of
from helpers.kept import run_kept
from helpers.needed import needs
from helpers.urdf_text import joint, link, mimic, robot
from linkwise import LinkwiseError, Options, generate, read_system, write_package
from linkwise.check import check_package
from linkwise.cli.app import app
from linkwise.emit.backend import BACKENDS
from linkwise.emit.c.loop_costs import decomposition_cost, link_costs
from linkwise.kernel_choice import check_size, chosen_kernel
from linkwise.package.load import import_package
from linkwise.package.manifest import Manifest
from typer.testing import CliRunner

from emit.test_emitted_c import COMPILERS, aligned, counting, strict

CRANE, LEG, TURNTABLE = str(DATA / "crane.urdf"), str(DATA / "leg.toml"), str(DATA / "turntable.py")
KNEE = str(DATA / "knee.osim")
FIELDS = ("acceleration", "velocity", "gravity", "torque")


def crane(folder: Path, options: Options) -> Path:
    """Package of a tree with slides, a part without mass, and joints that follow another."""
    write_package(generate(read_system(CRANE, options), ["numpy", "c"], kernel="loops"), folder / "crane")
    return folder / "crane"


@needs_compiler
@pytest.mark.parametrize(
    "options",
    [Options(), Options("symbolic", base="floating")],
    ids=["numbers", "floating, with parameters"],
)
def test_every_function_agrees_with_a_recursion(options: Options, tmp_path: Path) -> None:
    """c2, c1, g, tau and c0 in double and float: one sample, few, blocks, past the cache, each link alone."""
    results = check_package(crane(tmp_path, options), samples=30)
    assert [result for result in results if result.failed] == []
    names = " ".join(result.name for result in results)
    for function in (
        "decomposition_blocksf",
        "torquef",
        "position_gradient",
        "link_5f",
        "posef",
        "jacobian_rate",
    ):
        assert f"crane_{function}" in names
    assert ("other parameters" in names) == (options.parameters == "symbolic")


@needs_compiler
@pytest.mark.parametrize("robot", ["puma560", LEG], ids=["arm", "tree"])
def test_it_answers_as_the_closed_forms_do(
    robot: str, package_of: Callable[[str], ModuleType], directory_of: Callable[[str], Path]
) -> None:
    straight, loops = package_of(robot).load("numpy"), Compiled(directory_of(f"{robot} loops"))
    for count in (1, 2, 16, 37):
        states = random_states(straight.n, count)
        expected, given = straight.packed(*states), loops.decomposition(*states)
        for field in FIELDS:
            assert relative_error(given[field], getattr(expected, field)) <= 1e-14, (count, field)
        slopes = straight.position_gradient(*states)[:, *straight.layout.velocity.T]
        assert relative_error(loops.position_gradient(*states), slopes) <= 1e-14, count


@needs_compiler
@pytest.mark.parametrize("kernel", ["straight", "loops"])
def test_a_wide_tree_answers_with_its_zeros(kernel: str, tmp_path: Path) -> None:
    """24 joints, of which two move a link at most: the other rows of a link's results wait nowhere."""
    path = tmp_path / "brush.urdf"
    path.write_text(brush(12, "ab"), encoding="utf-8")
    write_package(generate(read_system(path), ["native", "numpy"], kernel=kernel), tmp_path / "brush")
    package, states = import_package(tmp_path / "brush"), random_states(24, 13)
    native, rule = package.load("native"), package.load("numpy", kernel="rule")
    answers = [(*r.propagation(*states), r.position_gradient(*states)) for r in (native, rule)]
    for given, expected in zip(*answers, strict=True):
        assert relative_error(given, expected) <= 1e-13


def brush(legs: int, parts: str) -> str:
    """URDF of legs on one base, each of these parts behind a joint."""
    links, joints = [link("base")], []
    for leg in range(legs):
        for up, part in pairwise(("", *parts)):
            above = f"{up}{leg}" if up else "base"
            links.append(link(f"{part}{leg}"))
            at = {"xyz": f"{leg} 0.1 0", "rpy": "0 0 0", "axis": "0 1 0"}
            joints.append(joint(f"{part}j{leg}", above, f"{part}{leg}", **at))
    return robot(*links, *joints)


@needs_compiler
@pytest.mark.parametrize("speed", [1.0, 1e4])
def test_torques_err_by_the_rounding_of_what_they_are_summed_from(
    speed: float, package_of: Callable[[str], ModuleType], directory_of: Callable[[str], Path]
) -> None:
    """Float is held against double, also where velocities ask a large force of a link that no joint bears."""
    package, loops = package_of("puma560"), import_package(directory_of("puma560 loops")).load("native")
    arrays = package.load("numpy", kernel="rule")
    q, qd, qdd = (a.astype(np.float32) for a in random_states(6, 100))
    motion = q, np.float32(speed) * qd, qdd
    exact = [a.astype(float) for a in motion]
    expected = package.load("numpy", kernel="straight").partial_torque(*exact)
    mass = np.abs(package.load("numpy").coefficients(*exact[:2]).acceleration).max((1, 3))
    moved = (exact[1] ** 2).sum(-1) + np.sqrt((exact[2] ** 2).sum(-1))
    scale = mass * moved[:, None] + np.abs(expected).max(1)
    for kernel in (loops, arrays):
        error = np.abs(kernel.partial_torque(*motion) - expected).max(1)
        assert (error / scale).max() <= 16 * np.finfo(np.float32).eps


def test_where_the_base_is_does_not_matter(tmp_path: Path) -> None:
    library = Compiled(crane(tmp_path, Options(base="floating")))
    q, qd, qdd = random_states(9, 5)
    here = library.decomposition(q, qd, qdd)
    q[:, :3] += 1e6
    for field, values in library.decomposition(q, qd, qdd).items():
        assert (values == here[field]).all(), field


@pytest.mark.parametrize("compiler", COMPILERS)
def test_it_compiles_without_a_warning_whole_and_in_parts(
    compiler: str, directory_of: Callable[[str], Path], tmp_path: Path
) -> None:
    directory = directory_of("planar3 symbolic loops")
    if compiler == "gcc":
        library_of(directory)
    else:
        check_syntax(directory, strict(compiler))
    link_parts(directory, strict(compiler), tmp_path)


@needs_compiler
@pytest.mark.parametrize("behind", [0, 16], ids=["on a line", "off a line"])
def test_large_blocks_go_past_the_cache_where_lines_are_whole(
    behind: int, directory_of: Callable[[str], Path], tmp_path: Path
) -> None:
    """c2 and c1, and not the few values of g and tau; the numbers are those of few blocks."""
    compiler = ("gcc", "-std=c99", "-O1", "-mavx", "-DLARGE=(size_t)16384", *counting(tmp_path, 32))
    compile_library(directory_of("puma560 loops"), tmp_path / "library.so", compiler)
    library = ctypes.CDLL(str(tmp_path / "library.so"))
    sizes, few, many = (56, 91, 21, 21), 1, 12
    motion = [rows.reshape(many, 8, 6).swapaxes(1, 2).copy() for rows in random_states(6, many * 8)]

    def computed(blocks: int) -> list[np.ndarray]:
        results = [aligned(blocks * 8 * size, np.float64, behind) for size in sizes]
        arrays = [ctypes.c_void_p(a.ctypes.data) for a in (*motion, *results)]
        library.puma560_decomposition_blocks(ctypes.c_size_t(blocks), *arrays)
        return results

    expected = computed(few)
    streamed, unfenced = (ctypes.c_long.in_dll(library, name) for name in ("streamed", "unfenced"))
    assert streamed.value == 0
    results = computed(many)
    assert streamed.value == (0 if behind else results[0].nbytes + results[1].nbytes)
    assert unfenced.value == 0
    for a, b in zip(results, expected, strict=True):
        assert (a[: b.size] == b).all()


@needs_compiler
def test_blocks_that_are_one_vector_are_filled_as_others(
    directory_of: Callable[[str], Path], package_of: Callable[[str], ModuleType], tmp_path: Path
) -> None:
    """Some registers are as wide as a block; gcc takes such vectors apart for others."""
    wide = ("gcc", "-std=c99", "-O1", "-mavx", "-D__AVX512F__", "-Wno-psabi", *counting(tmp_path, 64))
    directory = directory_of("puma560 loops")
    compile_library(directory, tmp_path / "library.so", wide)
    library, states = ctypes.CDLL(str(tmp_path / "library.so")), random_states(6, 24)
    motion = [rows.reshape(3, 8, 6).swapaxes(1, 2).copy() for rows in states]
    results = [np.empty((3, size, 8)) for size in (56, 91, 21, 21)]
    arrays = [ctypes.c_void_p(a.ctypes.data) for a in (*motion, *results)]
    library.puma560_decomposition_blocks(ctypes.c_size_t(3), *arrays)
    expected = package_of("puma560").load("numpy").packed(*states)
    for field, made in zip(FIELDS, results, strict=True):
        whole = made.swapaxes(1, 2).reshape(24, -1)
        assert relative_error(whole, getattr(expected, field)) <= 1e-14, field


@needs_compiler
@pytest.mark.parametrize("behind", [0, 16], ids=["on a line", "off a line"])
def test_reactions_of_many_rows_go_past_the_cache(
    behind: int, directory_of: Callable[[str], Path], tmp_path: Path
) -> None:
    """The numbers are those of few rows at a time, the last ones' too, which do not fill a block."""
    compiler = ("gcc", "-std=c99", "-O1", "-mavx", "-DLARGE=(size_t)16384", *counting(tmp_path, 32))
    compile_library(directory_of("puma560 loops"), tmp_path / "library.so", compiler)
    library = ctypes.CDLL(str(tmp_path / "library.so"))
    sizes, few, many = (126, 126, 36), 6, 12 * 8 + 3
    motion = random_states(6, many)[:2]

    def borne(first: int, count: int) -> list[np.ndarray]:
        results = [aligned(count * size, np.float64, behind).reshape(count, size) for size in sizes]
        given = [rows[first : first + count].copy() for rows in motion]
        arrays = [ctypes.c_void_p(a.ctypes.data) for a in (*given, *results)]
        library.puma560_reactions(ctypes.c_size_t(count), *arrays)
        return results

    pieces = [borne(first, min(few, many - first)) for first in range(0, many, few)]
    streamed, unfenced = (ctypes.c_long.in_dll(library, name) for name in ("streamed", "unfenced"))
    assert streamed.value == 0
    results = borne(0, many)
    torn = 64 if behind else 0  # bytes of the first and the last line of each block of each array
    assert streamed.value == (many // 8) * (8 * 8 * sum(sizes) - 3 * torn)
    assert unfenced.value == 0
    for field, whole in enumerate(results):
        assert (whole == np.concatenate([piece[field] for piece in pieces])).all()


@needs_compiler
def test_its_code_does_not_grow_with_the_robot(directory_of: Callable[[str], Path], tmp_path: Path) -> None:
    def instructions(robot: str) -> int:
        source, made = directory_of(f"{robot} loops") / "c" / f"{robot}.c", tmp_path / "robot.o"
        run_kept(["gcc", "-std=c99", "-O2", "-DLINKWISE_PART=BLOCKS", "-c", source], made)
        sizes = subprocess.run(["size", "-A", made], check=True, capture_output=True, text=True).stdout
        return int(re.findall(r"^\.text\S* +(\d+)", sizes, re.M)[0])

    assert instructions("planar20") < 1.1 * instructions("planar3")


@needs("g++")
@pytest.mark.parametrize("robot", [CRANE, "puma560", KNEE], ids=["crane", "arm", "knee"])
def test_the_header_counts_its_operations(
    robot: str, directory_of: Callable[[str], Path], tmp_path: Path
) -> None:
    directory = directory_of(f"{robot} loops")
    name = name_of(directory)
    defined = f'-DSOURCE="{directory / "c" / name}.c"'
    made = tmp_path / "count"
    run_kept(["g++", "-std=c++17", "-w", defined, DATA / "count_operations.cpp"], made)
    counted = subprocess.run([made], check=True, capture_output=True, text=True).stdout.split()
    header = (directory / "c" / f"{name}.h").read_text(encoding="utf-8")
    told = [re.search(rf"{what}: (\d+) operations", header) for what in ("but c0", "Torques alone")]
    # Besides, numbers that do not vary are spread over all samples: 2 for the base, 5 for each link.
    links = len(Manifest.read(directory).links)
    assert [int(count) - 2 - 5 * links for count in counted] == [int(found[1]) for found in told if found]


def test_a_link_counts_what_a_robot_counts_that_has_no_other(tmp_path: Path) -> None:
    """The links are those of a finger, whose second joint follows the first."""
    finger = joint("a", "base", "one") + joint("b", "one", "tip", inner=mimic("a", 0.5))
    (tmp_path / "finger.urdf").write_text(robot(link("base"), '<link name="one"/>', link("tip"), finger))
    system = read_system(tmp_path / "finger.urdf")
    assert link_costs(system) == [decomposition_cost(system)]


@needs_compiler
@pytest.mark.parametrize("backend", ["numpy", "torch", "autograd", "native"])
def test_every_back_end_answers_without_closed_forms(
    backend: str, directory_of: Callable[[str], Path], package_of: Callable[[str], ModuleType]
) -> None:
    torch = pytest.importorskip("torch")
    robot = import_package(directory_of("puma560 loops")).load(backend)
    states = random_states(6, 5)
    expected = package_of("puma560").load("numpy", kernel="straight").propagation(*states)
    tensors = [torch.from_numpy(a) for a in states]
    given = robot.propagation(*(states if backend in ("numpy", "native") else tensors))
    for one, other in zip(given, expected, strict=True):
        assert relative_error(one, other) <= 1e-13
    if backend != "numpy":
        slopes = torch.autograd.functional.jacobian(
            lambda q: robot.partial_torque(q, *tensors[1:]).sum(0), tensors[0]
        )
        stiffness = package_of("puma560").load("numpy").position_gradient(*states)
        assert relative_error(slopes.movedim(2, 0), stiffness) <= 1e-12


@pytest.mark.parametrize(
    ("robot", "choice", "kernel"),
    [
        ("planar3", "auto", "straight"),
        ("planar40", "auto", "loops"),
        ("planar3", "loops", "loops"),
        (TURNTABLE, "auto", "straight"),
    ],
)
def test_the_manifest_says_which_kernel_was_chosen(robot: str, choice: str, kernel: str) -> None:
    manifest = json.loads(generate(read_system(robot), ["c"], kernel=choice)["manifest.json"])
    assert manifest["kernel"] == kernel
    assert all(link["operations"] > 0 for link in manifest["links"])


@pytest.mark.parametrize(("turn", "kernel"), [("0 0 0", "straight"), ("1.5707963267948966 0 0", "loops")])
def test_what_parallel_axes_save_is_seen(turn: str, kernel: str, tmp_path: Path) -> None:
    """Fourteen joints, whose axes are parallel or at right angles: as many results, and another choice."""
    names = "abcdefghijklmno"
    arm = [joint(a + b, a, b, rpy=turn, axis="0 0 1") for a, b in pairwise(names)]
    path = tmp_path / "arm.urdf"
    path.write_text(robot(*map(link, names), *arm), encoding="utf-8")
    assert chosen_kernel(read_system(path), "auto", None) == kernel


def test_a_joint_each_for_many_links_is_straight_and_may_be_in_loops(tmp_path: Path) -> None:
    """Links behind one joint have almost nothing to compute, and no limit goes by their number."""
    path = tmp_path / "brush.urdf"
    path.write_text(brush(300, "a"), encoding="utf-8")
    system = read_system(path)
    assert chosen_kernel(system, "auto", None) == "straight"
    for kernel in ("straight", "loops"):
        check_size(system, kernel, None)


def test_auto_is_straight_where_loops_cannot_be(monkeypatch: pytest.MonkeyPatch) -> None:
    system = read_system("planar40")
    monkeypatch.setattr("linkwise.emit.c.stack.MOST_STACK", 400_000)
    assert chosen_kernel(system, "auto", None) == "straight"
    assert chosen_kernel(system, "auto", ["numpy"]) == "loops"
    told = "of stack, and 400000 are the most; take --kernel straight"
    with pytest.raises(LinkwiseError, match=re.escape(told)):
        generate(system, kernel="loops")


def test_a_robot_too_large_is_refused_before_any_work() -> None:
    """No file is rendered: nothing reports progress."""
    told = "400 joints are too many for C in loops: .*; take back ends without c: --backend numpy, say"
    with pytest.raises(LinkwiseError, match=told):
        generate(read_system("planar400"), progress=lambda *at: pytest.fail(f"at work: {at}"))


@needs_compiler
@pytest.mark.parametrize(
    ("robot", "kernel"), [("planar40", "loops"), ("puma560", "straight")], ids=["loops", "straight"]
)
def test_the_header_says_how_much_stack_it_takes(robot: str, kernel: str, tmp_path: Path) -> None:
    write_package(generate(read_system(robot), ["c"], kernel=kernel), tmp_path / robot)
    header = (tmp_path / robot / "c" / f"{robot}.h").read_text(encoding="utf-8")
    told = int(re.findall(r"of which none takes\s+more than ([\d,]+) bytes", header)[0].replace(",", ""))
    command = ["gcc", "-std=c99", "-O2", "-fstack-usage", "-c", tmp_path / robot / "c" / f"{robot}.c"]
    run_kept(command, tmp_path / "robot.o")
    lines = (tmp_path / "robot.su").read_text(encoding="utf-8").splitlines()
    most = max(int(line.split("\t")[1]) for line in lines)
    assert 0.85 * told < most < told


def test_formulas_asked_for_by_name_are_derived(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("linkwise.kernel_choice.MOST_STRAIGHT", 0)
    kernels = {
        backend: json.loads(generate(read_system("planar3"), [backend])["manifest.json"])["kernel"]
        for backend in ("formulas", "numpy", "c")
    }
    assert kernels == {"formulas": "straight", "numpy": "loops", "c": "loops"}


@pytest.mark.parametrize(
    ("robot", "asked", "told"),
    [
        (
            TURNTABLE,
            {"kernel": "loops"},
            "turntable.py: --kernel loops goes over rigid bodies, and here are energies",
        ),
        (
            "planar3",
            {"kernel": "loops", "backends": ["formulas"]},
            "'formulas' is not there with --kernel loops",
        ),
        (KNEE, {"backends": ["formulas"]}, "follows a curve, and no closed forms are derived for that"),
        (KNEE, {"backends": ["foo"]}, "no back end 'foo'; choose among numpy, torch,"),
        ("planar3", {"backends": []}, "no back end is asked for; choose among numpy, torch,"),
        ("planar160", {"backends": ["c"]}, "160 joints are too many for C in loops: it answers with"),
        ("planar3", {"kernel": "curved"}, "no kernel 'curved'; choose among auto, straight, loops"),
    ],
)
def test_a_kernel_that_cannot_be_is_refused(robot: str, asked: dict[str, object], told: str) -> None:
    with pytest.raises(LinkwiseError, match=re.escape(told)):
        generate(read_system(robot), **asked)  # type: ignore[arg-type]


OF_EVERY_PACKAGE = {"__init__.py", "names.py", "py.typed", "manifest.json"}


@pytest.mark.parametrize(
    ("robot", "kernel", "refused"),
    [
        ("planar3", "straight", set()),
        ("planar4", "straight", set()),
        ("planar4", "loops", {"formulas"}),
        (KNEE, "auto", {"formulas"}),
        (TURNTABLE, "auto", set()),
    ],
)
def test_a_back_end_is_refused_or_has_files_of_its_own(robot: str, kernel: str, refused: set[str]) -> None:
    system, without = read_system(robot), set()
    for backend in BACKENDS:
        try:
            files = generate(system, iter([backend]), kernel=kernel)
        except LinkwiseError:
            without.add(backend)
        else:
            own = set(files) - OF_EVERY_PACKAGE
            assert own, backend
    assert without == refused
    usual = json.loads(generate(system, kernel=kernel)["manifest.json"])["request"]["backends"]
    unread = {"formulas"} if robot == "planar4" else set()  # which nobody would read from end to end
    assert set(usual) == BACKENDS.keys() - refused - unread


def test_the_flag_chooses_the_kernel(tmp_path: Path) -> None:
    def run(robot: str) -> int:
        return (
            CliRunner()
            .invoke(app, ["generate", robot, "--kernel", "loops", "--out", str(tmp_path)])
            .exit_code
        )

    assert run("planar3") == 0
    request = json.loads((tmp_path / "planar3" / "manifest.json").read_text())["request"]
    assert (request["kernel"], request["backends"]) == (
        "loops",
        ["numpy", "torch", "autograd", "native", "c"],
    )
    assert not (tmp_path / "planar3" / "forms").exists()
    assert run(TURNTABLE) != 0
    shutil.rmtree(tmp_path / "planar3")
