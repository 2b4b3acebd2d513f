"""The emitted C compiles without a warning and says what NumPy says, in either precision, for any count."""

import ctypes
import os
import platform
import re
import shutil
import subprocess
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from conftest import DATA, PANDA, needs_compiler
from helpers.answers import random_states, relative_error
from helpers.compiled import Compiled, check_syntax, compile_library, library_of, link_parts, name_of
from helpers.kept import run_kept
from helpers.needed import missing
from helpers.urdf_text import chain, joint
from linkwise import Coordinate, LinkEnergy, Options, energy_system, generate, read_system, write_package
from linkwise.oracle.newton_euler import NewtonEuler
from linkwise.package.load import import_package
from linkwise.package.manifest import Manifest

pytestmark = needs_compiler
TURNTABLE = str(DATA / "turntable.py")
LEG = str(DATA / "leg.toml")
WEIGHTS = str(DATA / "weights.py")
ROBOTS = ["planar3", "planar3 symbolic", "puma560", TURNTABLE, LEG, WEIGHTS]
SEVEN_JOINTS = pytest.param(
    str(PANDA),
    marks=pytest.mark.skipif(not PANDA.is_file(), reason="needs real robots: pip install example-robot-data"),
    id="panda",
)
COMPILERS = {
    "gcc": ("gcc", "-std=c99"),
    "clang": ("clang", "-std=c99"),
    "g++": ("g++", "-x", "c++", "-std=c++17"),
    "clang++": ("clang++", "-x", "c++", "-std=c++17"),
}


def strict(compiler: str) -> tuple[str, ...]:
    if absent := missing(compiler):
        pytest.skip(absent)
    return COMPILERS[compiler]


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize(
    "robot", ROBOTS, ids=["planar3", "symbolic", "puma560", "energies", "tree", "weights"]
)
def test_it_compiles_without_a_warning(
    robot: str, compiler: str, directory_of: Callable[[str], Path]
) -> None:
    if compiler == "gcc":  # as all tests of these robots have it
        library_of(directory_of(robot))
    else:
        check_syntax(directory_of(robot), strict(compiler))


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("robot", [pytest.param("planar3 symbolic", id="symbolic"), SEVEN_JOINTS])
def test_its_parts_compile_without_a_warning_and_link(
    robot: str, compiler: str, directory_of: Callable[[str], Path], tmp_path: Path
) -> None:
    link_parts(directory_of(robot), strict(compiler), tmp_path)


def test_the_header_says_how_to_compile_it(directory_of: Callable[[str], Path], tmp_path: Path) -> None:
    header = (directory_of("planar3") / "c" / "planar3.h").read_text(encoding="utf-8")
    shutil.copytree(directory_of("planar3") / "c", tmp_path / "c")
    if platform.machine() in ("aarch64", "arm64"):
        _, arm, x86 = re.split(r"On ARM, write (.*) in place of (.*)\.", header)[:3]
        header = header.replace(x86, arm)
    commands = [line.split() for line in header.splitlines() if re.match(r" +(cc|c\+\+) ", line)]
    assert [command[0] for command in commands] == ["cc", "cc", "c++"]
    for command, made in zip(commands, ("planar3.o", "planar3f.o", "planar3.o"), strict=True):
        run_kept(command, tmp_path / "c" / made, tmp_path / "c", named=False)
        (tmp_path / "c" / made).unlink()


def test_the_header_says_of_each_function_whether_it_reads_parameters() -> None:
    for request, has in (("numeric", False), ("symbolic", True)):
        header = generate(read_system("planar3", Options(request)), ["c"])["c/planar3.h"]
        functions = re.findall(r"/\*([^/]*?\bReads [^/]*?)\*/\n(?:void|int) (\w+)\(([^)]*)\);", header)
        assert len(functions) >= 30
        for text, name, arguments in functions:
            assert ("p (PARAMETERS)" in text) == bool(re.search(r"\*p\b", arguments)) == has, name


def test_the_header_gives_units_by_those_of_the_joints(directory_of: Callable[[str], Path]) -> None:
    def units(robot: str, quantity: str) -> list[str]:
        text = (directory_of(robot) / "c" / f"{name_of(directory_of(robot))}.h").read_text(encoding="utf-8")
        line = next(line for line in text.splitlines() if line.strip().startswith(quantity))
        return re.split(r" {3,}", line.strip())[1:-1]

    assert units("planar3", "c2(") == ["kg m^2"]
    assert units("planar3", "c0(") == ["N m/rad"]
    assert units(LEG, "i, k in") == ["rad, rad", "rad, m", "m, rad", "m, m"]
    assert units(LEG, "c1(") == ["kg m^2/s", "kg m/s", "kg m/s", "kg/s"]
    assert units(LEG, "g(") == ["N m", "N m", "N", "N"]


def test_files_of_links_say_their_frame_where_they_have_one(directory_of: Callable[[str], Path]) -> None:
    def head(robot: str, file: str) -> str:
        return (directory_of(robot) / "c" / file).read_text(encoding="utf-8").split("*/")[0]

    assert re.search(r"axes    \S.*\n +origin  \S", head("planar3", "link_2.h"))
    assert "axes" not in head(TURNTABLE, "link_1.h")


def test_what_a_robot_has_no_use_for_is_not_in_its_functions(directory_of: Callable[[str], Path]) -> None:
    def text(robot: str) -> str:
        directory = directory_of(robot)
        return (directory / "c" / f"{name_of(directory)}.h").read_text(encoding="utf-8")

    def code(robot: str) -> str:
        return re.sub(r"/\*.*?\*/", "", text(robot), flags=re.S)

    assert "h1" not in text("planar3")
    assert "Each function reads q, qd, qdd (JOINTS). */" in text("planar3")
    assert "1/2 d(tau)/d(qd) + h1/2" in text(TURNTABLE)
    assert not re.search(r"\b(h1|\w+_H1|p|\w+_PARAMETERS)\b", code("planar3"))
    assert re.search(r"\*p\b", code("planar3 symbolic"))
    assert re.search(r"\*h1\b", code(TURNTABLE))


@pytest.mark.parametrize("robot", ["torso", LEG, TURNTABLE], ids=["tree", "leg", "energies"])
def test_the_header_says_where_each_links_entries_begin_and_which_joints_move_it(
    robot: str, directory_of: Callable[[str], Path], package_of: Callable[[str], ModuleType]
) -> None:
    directory = directory_of(robot)
    text = (directory / "c" / f"{name_of(directory)}.h").read_text(encoding="utf-8")
    rows = re.findall(r"^   (\d+) {3,}(\d[\d to]*?) {3,}(\d[\d ]*?) {3,}'", text, re.M)
    links, layout = Manifest.read(directory).links, package_of(robot).load("numpy").layout
    assert len(rows) == len(links)
    for row, link in zip(rows, links, strict=True):
        first, to, last = row[1].partition(" to ")
        joints = range(int(first), int(last) + 1) if to else map(int, row[1].split())
        assert [joint - 1 for joint in joints] == list(link.path)
        arrays = (layout.acceleration, layout.velocity, layout.gravity, layout.velocity_excess)
        for start, entries in zip(map(int, row[2].split()), arrays, strict=False):
            own = [place for place, entry in enumerate(entries) if entry[1] == int(row[0]) - 1]
            assert start == own[0]


@pytest.mark.parametrize("robot", ["planar3", "puma560", LEG, TURNTABLE, SEVEN_JOINTS])
def test_the_index_and_every_label_agree_with_the_layout(
    robot: str, directory_of: Callable[[str], Path], package_of: Callable[[str], ModuleType]
) -> None:
    folder, name = directory_of(robot) / "c", name_of(directory_of(robot))
    text = (folder / f"{name}_index.h").read_text(encoding="utf-8")
    layout = package_of(robot).load("numpy").layout
    fields = {
        "c2": layout.acceleration,
        "c1": layout.velocity,
        "g": layout.gravity,
        "h1": layout.velocity_excess,
    }
    entries: dict[str, list[str]] = {}
    for array, rows in fields.items():
        table = re.search(rf"{name}_{array}_index\[\w+\]\[\d\] = {{(.*?)}};", text, re.S)
        found = re.findall(r"{([\d, ]+)}", table[1]) if table else []
        assert found == [", ".join(str(index + 1) for index in row) for row in rows]
        entries[array] = found
    entries |= {"tau": entries["g"], "c0": entries["c1"]}
    for path in folder.glob("link_*.h"):
        for function in path.read_text(encoding="utf-8").split("\nLINK_FUNCTION(")[1:]:
            link = re.match(r"link_(\d+)", function)
            labels = re.findall(r"(\w+)\[(\d+) \* W \+ b\] = .*; /\* (\w+)\((.*)\) \*/", function)
            for array, entry, label, indices in labels:
                assert link
                own = [e for e in entries[array] if e.split(", ")[1] == link[1]]
                assert (label, indices) == (array, own[int(entry)])
            assert labels or not link


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("robot", ["puma560", LEG], ids=["arm", "tree"])
def test_it_says_what_numpy_says_for_any_count(
    robot: str,
    dtype: type,
    directory_of: Callable[[str], Path],
    package_of: Callable[[str], ModuleType],
) -> None:
    library, reference = Compiled(directory_of(robot)), package_of(robot).load("numpy")
    tolerance = 1e-13 if dtype is np.float64 else 1e-5
    fields = ("acceleration", "velocity", "gravity", "torque")
    for count in (1, 2, 16, 37):
        states = tuple(m.astype(dtype) for m in random_states(reference.n, count))
        exact = tuple(m.astype(float) for m in states)
        expected, given = reference.packed(*exact), library.decomposition(*states)
        for field in fields:
            assert relative_error(given[field], getattr(expected, field)) <= tolerance, (count, field)
        assert relative_error(library.torque(*states), expected.torque) <= tolerance, count
        slopes = reference.position_gradient(*exact)[:, *reference.layout.velocity.T]
        assert relative_error(library.position_gradient(*states), slopes) <= tolerance, count
    assert library.decomposition(*(m[:0] for m in states))["torque"].shape[0] == 0
    states = tuple(m.astype(dtype) for m in random_states(reference.n, 48))
    expected = reference.packed(*(m.astype(float) for m in states))
    given = library.decomposition_of_blocks(*states)
    for field in fields:
        assert relative_error(given[field], getattr(expected, field)) <= tolerance, field
    for link in range(reference.N):
        own = [getattr(reference.layout, field)[:, 1] == link for field in fields]
        one = library.link(link + 1, [mask.sum() for mask in own], *(m[5] for m in states))
        for field, mask, values in zip(fields, own, one, strict=True):
            scale = np.abs(getattr(expected, field)).max()
            np.testing.assert_allclose(values, getattr(expected, field)[5, mask], atol=tolerance * scale)


def recursion(directory: Path, q: np.ndarray, qd: np.ndarray) -> dict[str, np.ndarray]:
    """Dense c2, c1 and g of every link from torques alone, by a recursion that knows nothing of closed forms.

    tau is linear in qdd and quadratic in qd, for which differences are exact: c1 = 1/2 d(tau)/d(qd).
    """
    manifest = Manifest.read(directory)
    assert manifest.tree is not None
    torque, rest = NewtonEuler(manifest, manifest.tree).partial_torque, np.zeros_like(q)
    gravity = torque(q, rest, rest)
    units = [np.broadcast_to(row, q.shape) for row in np.eye(q.shape[-1])]
    c2 = [torque(q, rest, unit) - gravity for unit in units]
    c1 = [(torque(q, qd + unit, rest) - torque(q, qd - unit, rest)) / 4.0 for unit in units]
    return {"acceleration": np.stack(c2, -1), "velocity": np.stack(c1, -1), "gravity": gravity}


def test_a_tree_says_what_a_recursion_says(
    directory_of: Callable[[str], Path], package_of: Callable[[str], ModuleType]
) -> None:
    directory = directory_of("torso")
    library, native = Compiled(directory), package_of("torso").load("native")
    q, qd, qdd = random_states(native.n, 136)  # a whole tile and more, in float too
    expected = recursion(directory, q, qd)
    expected["torque"] = (
        sum(
            np.einsum("sijk,sk->sij", expected[field], motion)
            for field, motion in (("acceleration", qdd), ("velocity", qd))
        )
        + expected["gravity"]
    )
    single = [library.decomposition(*(m[s : s + 1] for m in (q, qd, qdd))) for s in range(3)]
    for field, dense in expected.items():
        values = dense[:, *getattr(native.layout, field).T]
        answers = {
            "rows": library.decomposition(q, qd, qdd)[field],
            "rows that end amid a block": library.decomposition(q[:131], qd[:131], qdd[:131])[field],
            "blocks": library.decomposition_of_blocks(q, qd, qdd)[field],
            "native": getattr(native.packed(q, qd, qdd), field),
        }
        for name, given in answers.items():
            assert relative_error(given, values[: len(given)]) <= 1e-13, (name, field)
        assert relative_error(np.concatenate([one[field] for one in single]), values[:3]) <= 1e-13, field
    few = tuple(m.astype(np.float32) for m in (q, qd, qdd))
    assert relative_error(library.decomposition(*few)["torque"], answers["native"]) <= 1e-5
    assert relative_error(native.packed_torque(q, qd, qdd), answers["native"]) <= 1e-13


def test_results_that_no_cache_holds_are_the_same(directory_of: Callable[[str], Path]) -> None:
    library = Compiled(directory_of("planar3"))
    few = random_states(3, 512)
    expected = library.decomposition(*few)
    repeats = (20 << 20) // (8 * sum(library.sizes.values())) // 512 + 1
    many = [np.tile(m, (repeats, 1)) for m in few]
    for given in (library.decomposition(*many), library.decomposition_of_blocks(*many)):
        for field, values in expected.items():
            assert (given[field].reshape(repeats, 512, -1) == values).all(), field


COUNTING = """
/* In place of the compiler's own: counts bytes stored past the cache, and those that no fence has ordered. */
__attribute__((weak)) long streamed = 0, unfenced = 0;
#define STREAM(to, value) (*(to) = (value), streamed += STREAM_BYTES, unfenced += 1)
#define STREAM_END() (unfenced = 0)
"""


def counting(folder: Path, line: int) -> tuple[str, ...]:
    """Flags that count what goes past the cache, in vectors of so many bytes."""
    (folder / "counting.h").write_text(COUNTING, encoding="utf-8")
    return "-include", str(folder / "counting.h"), f"-DSTREAM_BYTES={line}", "-Wno-psabi"


def aligned(count: int, dtype: type, behind: int) -> np.ndarray:
    """Memory that begins some bytes behind the begin of a cache line."""
    room = np.zeros(count * np.dtype(dtype).itemsize + 128, np.uint8)
    start = -room.ctypes.data % 64 + behind
    return room[start : start + count * np.dtype(dtype).itemsize].view(dtype)


RESULTS = {
    "decomposition": (10, 14, 6, 6),
    "decomposition_blocks": (10, 14, 6, 6),
    "propagation": (27, 27, 9),
}
"""Values of a sample of planar3 in each array of what streams."""


@pytest.fixture(scope="module")
def counts(
    directory_of: Callable[[str], Path], tmp_path_factory: pytest.TempPathFactory
) -> Callable[[int], ctypes.CDLL]:
    """Library of planar3 that counts what goes past the cache, in vectors of so many bytes."""

    @cache
    def library(line: int) -> ctypes.CDLL:
        folder = tmp_path_factory.mktemp("counting")
        compiler = ("gcc", "-std=c99", *counting(folder, line))
        compile_library(directory_of("planar3"), folder / "library.so", compiler)
        return ctypes.CDLL(str(folder / "library.so"))

    return library


@pytest.mark.parametrize("behind", [0, 16], ids=["on a line", "off a line"])
@pytest.mark.parametrize("name", RESULTS)
@pytest.mark.parametrize(("dtype", "line"), [(np.float64, 64), (np.float32, 32)])
def test_stores_past_the_cache_are_whole_lines_and_end_with_a_fence(
    dtype: type,
    line: int,
    name: str,
    behind: int,
    counts: Callable[[int], ctypes.CDLL],
) -> None:
    library = counts(line)
    suffix, width = ("f", 16) if dtype is np.float32 else ("", 8)
    compute = getattr(library, f"planar3_{name}{suffix}")
    compute.restype = None
    sizes, blocks = RESULTS[name], name.endswith("blocks")
    count = (20 << 20) // (sum(sizes) * np.dtype(dtype).itemsize) // width * width + 5 * width
    outputs = [aligned(count * size, dtype, behind) for size in sizes]
    motion = np.tile(np.full(3, 0.5, dtype), count)
    pointers = [ctypes.c_void_p(a.ctypes.data) for a in (motion, motion, motion, *outputs)]
    streamed, unfenced = (ctypes.c_long.in_dll(library, name) for name in ("streamed", "unfenced"))
    streamed.value = unfenced.value = 0
    compute(ctypes.c_size_t(width), *pointers)
    assert streamed.value == 0
    few = [a[: size * width].copy() for a, size in zip(outputs, sizes, strict=True)]
    for a in outputs:
        a.fill(9.0)
    compute(ctypes.c_size_t(count // width if blocks else count), *pointers)
    in_lines = outputs[:2] if name == "propagation" else outputs  # squares are written in place
    # Off a line, the line where one block of results ends and the next one begins is written as usual.
    shared = len(in_lines) * count // width if behind else 0
    assert streamed.value == sum(a.nbytes for a in in_lines) - 64 * shared
    assert unfenced.value == 0
    for a, size, first in zip(outputs, sizes, few, strict=True):
        samples = a.reshape(-1, size, width).swapaxes(1, 2) if blocks else a.reshape(-1, size)
        assert (a[: size * width] == first).all()
        assert (samples == samples[:1]).all()


@pytest.mark.parametrize(
    "robot", ["planar3", "torso", LEG, TURNTABLE], ids=["arm", "sharing", "tree", "energies"]
)
@pytest.mark.parametrize("dtype", [np.float64, np.float32])
def test_functions_that_write_zeros_say_what_numpy_says_for_any_count(
    robot: str,
    dtype: type,
    directory_of: Callable[[str], Path],
    package_of: Callable[[str], ModuleType],
) -> None:
    library, reference = Compiled(directory_of(robot)), package_of(robot).load("numpy")
    tolerance = 1e-13 if dtype is np.float64 else 1e-5
    off = np.ones((reference.n, reference.N), dtype=bool)
    off[*reference.layout.torque.T] = False
    for count in (0, 1, 2, 16, 37):
        states = tuple(m.astype(dtype) for m in random_states(reference.n, count))
        exact = tuple(m.astype(float) for m in states)
        for call, (name, reads, convention) in {
            "partial_torque": ("partial_torque", 3, ()),
            "inverse_dynamics": ("inverse_dynamics", 3, ()),
            "coefficients": ("coefficients", 2, ()),
            "propagation": ("propagation", 3, ()),
            "gradient_propagation": ("propagation", 3, ("gradient",)),
            "dense_position_gradient": ("position_gradient", 3, ()),
        }.items():
            expected = getattr(reference, name)(*exact[:reads], *convention)
            fields = expected if isinstance(expected, tuple) else (expected,)
            given = library.dense(call, states[:reads], [field.shape[1:] for field in fields])
            for one, other in zip(given, fields, strict=True):
                assert relative_error(one, other) <= tolerance, (call, count)
                assert call == "inverse_dynamics" or (one[:, off] == 0.0).all(), (call, count)


GUARDED = """
#include "planar4.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
enum { N = PLANAR4_JOINTS, C2 = PLANAR4_C2, C1 = PLANAR4_C1, G = PLANAR4_G };
static const int SIZES[] = { C2, C1, G, G, G, C1 };
static real *room(size_t count)
{
    void *made;
    if (posix_memalign(&made, 64, count * sizeof(real)))
        exit(2);
    return made;
}
static void compute(size_t count, real *const *motion, real **out)
{
    for (int a = 0; a < 6; ++a)
        out[a] = room(count * SIZES[a]);
    API(planar4_decomposition)(count, motion[0], motion[1], motion[2], out[0], out[1], out[2], out[3]);
    API(planar4_torque)(count, motion[0], motion[1], motion[2], out[4]);
    API(planar4_position_gradient)(count, motion[0], motion[1], motion[2], out[5]);
}
int main(void)
{
    for (size_t count = 1; count < 40; ++count) {
        real *motion[3], *one[3], *all[6], *alone[6];
        for (int k = 0; k < 3; ++k) {
            motion[k] = room(count * N);
            one[k] = room(N);
            for (size_t e = 0; e < count * N; ++e)
                motion[k][e] = (real)(3.0 * cos(1.0 + k + 7.0 * e));
        }
        compute(count, motion, all);
        for (size_t s = 0; s < count; ++s) {
            for (int k = 0; k < 3; ++k)
                for (int e = 0; e < N; ++e)
                    one[k][e] = motion[k][s * N + e];
            compute(1, one, alone);
            for (int a = 0; a < 6; ++a)
                for (int e = 0; e < SIZES[a]; ++e)
                    if (!(fabs((double)(all[a][s * SIZES[a] + e] - alone[a][e])) < NEAR)) {
                        fprintf(stderr, "array %d, sample %d of %d, entry %d", a, (int)s, (int)count, e);
                        return 1;
                    }
            for (int a = 0; a < 6; ++a)
                free(alone[a]);
        }
        for (int a = 0; a < 6; ++a)
            free(all[a]);
        for (int k = 0; k < 3; ++k)
            free(motion[k]), free(one[k]);
    }
    return 0;
}
"""


@pytest.mark.parametrize(
    ("real", "kind"),
    [
        pytest.param("double", ("-DLARGE=(size_t)16384",), id="past the cache"),
        pytest.param("float", ("-U__GNUC__", "-D__GNUC__=11"), id="without vectors"),
    ],
)
def test_no_call_leaves_its_arrays_and_many_samples_are_one_by_one(
    real: str, kind: Sequence[str], directory_of: Callable[[str], Path], tmp_path: Path
) -> None:
    """Under gcc's address sanitizer. Arrays have 20, 30 and 10 entries: tiles of 8 do not fill them."""
    folder = directory_of("planar4") / "c"
    suffix, api, near = ("", "name", "1e-12") if real == "double" else ("f", "name##f", "1e-3")
    (tmp_path / "main.c").write_text(GUARDED, encoding="utf-8")
    defined = (f"-Dreal={real}", f"-DAPI(name)={api}", f"-DNEAR={near}")
    # What the others would say of pointers, the address sanitizer says at a third of the time to compile.
    told = ("-fsanitize=address,undefined", "-fno-sanitize=null,object-size,pointer-overflow")
    guard = ("gcc", "-O1", "-g", *told, "-fno-sanitize-recover=all", "-D_GNU_SOURCE")
    arm, main = tmp_path / "arm.o", tmp_path / "main"
    run_kept(
        [*guard, "-std=c99", *kind, *counting(tmp_path, 64), "-c", folder / f"planar4{suffix}.c"],
        arm,
    )
    run_kept([*guard, "-std=c99", *defined, f"-I{folder}", tmp_path / "main.c", arm, "-lm"], main)
    done = subprocess.run([main], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_every_constant_of_a_header_has_the_robots_name(directory_of: Callable[[str], Path]) -> None:
    """Headers of two robots go into one program."""
    header = (directory_of("planar4") / "c" / "planar4.h").read_text(encoding="utf-8")
    constants = dict(re.findall(r"^ +(\w+) = (\d+)", header, re.MULTILINE))
    assert [name for name in constants if not name.startswith("PLANAR4_")] == []
    refusals = [value for name, value in constants.items() if re.search("_TIES_|_NO|_UN|_STUCK", name)]
    assert sorted(map(int, refusals)) == list(range(1, 12)), "each says what it is"


def test_it_takes_run_time_parameters(
    directory_of: Callable[[str], Path], package_of: Callable[[str], ModuleType]
) -> None:
    package = package_of("planar3 symbolic")
    heavier = {name: 1.5 * value for name, value in package.parameters.items()}
    library = Compiled(directory_of("planar3 symbolic"), parameters=list(heavier.values()))
    states = random_states(3, 21)
    expected = package.load("numpy", parameters=heavier).packed(*states)
    assert relative_error(library.torque(*states), expected.torque) <= 1e-13
    assert relative_error(library.decomposition(*states)["velocity"], expected.velocity) <= 1e-13


def test_links_of_energies_with_and_without_linear_terms_go_together(tmp_path: Path) -> None:
    energies = tmp_path / "pair.py"
    energies.write_text(
        "from linkwise import Coordinate, LinkEnergy\n"
        "x, y = Coordinate('x', 'm'), Coordinate('y', 'm')\n"
        "name, coordinates = 'pair', [x, y]\n"
        "links = [\n"
        "    LinkEnergy('plain', x.qd**2 * (1 + x.q**2), 3 * x.q**2),\n"
        "    LinkEnergy('carried', (x.qd + y.q * y.qd) ** 2 + x.q * y.qd, 0),\n"
        "]\n",
        encoding="utf-8",
    )
    write_package(generate(read_system(energies)), tmp_path / "pair")
    library = Compiled(tmp_path / "pair")
    assert library.sizes["h1"] == 4
    states = random_states(2, 19)
    expected = import_package(tmp_path / "pair").load("numpy").packed(*states)
    given = library.decomposition(*states)
    assert relative_error(given["linear"], expected.velocity_excess) <= 1e-14
    assert relative_error(given["velocity"], expected.velocity) <= 1e-14
    for compiler in COMPILERS:
        if shutil.which(compiler):
            check_syntax(tmp_path / "pair", COMPILERS[compiler])


@pytest.mark.parametrize("compiler", COMPILERS)
def test_a_force_that_no_motion_changes_compiles_without_a_warning(compiler: str, tmp_path: Path) -> None:
    x = Coordinate("x", "m")
    write_package(
        generate(energy_system("weight", [x], [LinkEnergy("a", 0, 3 * x.q)])),
        tmp_path / "weight",
    )
    check_syntax(tmp_path / "weight", strict(compiler))


def test_no_samples_touch_no_memory(directory_of: Callable[[str], Path]) -> None:
    library = Compiled(directory_of("planar3")).library
    outputs = {"decomposition": 4, "decomposition_blocks": 4, "torque": 1, "position_gradient": 1}
    outputs |= {"partial_torque": 1, "inverse_dynamics": 1, "dense_position_gradient": 1}
    outputs |= {"propagation": 3, "gradient_propagation": 3, "coefficients": 2}
    child = os.fork()
    if child == 0:
        for name, count in outputs.items():
            for suffix in ("", "f"):
                nowhere = [ctypes.c_void_p(None)] * (3 + count)
                getattr(library, f"planar3_{name}{suffix}")(ctypes.c_size_t(0), *nowhere)
        os._exit(0)
    assert os.waitpid(child, 0)[1] == 0


@pytest.mark.parametrize(("joints", "told"), [("ab", "of link_1.h."), ("ab bc", "of link_1.h to link_2.h.")])
def test_the_code_of_a_robot_names_the_files_of_its_links(joints: str, told: str, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(chain(*(joint(name, *name) for name in joints.split())))
    write_package(generate(read_system(tmp_path / "arm.urdf"), ["native"]), tmp_path / "arm")
    assert f"The arithmetic is in the closed forms {told}" in (tmp_path / "arm/c/test.c").read_text()
