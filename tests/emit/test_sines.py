"""Sines and cosines of the emitted C, held against mpmath's."""

import ctypes
import shutil
from importlib import resources
from pathlib import Path

import mpmath
import numpy as np
import pytest
from helpers.kept import run_kept

SOURCE = """
#define API(function) F(own_##function)
#define LINKWISE_PART SINES
#include "linkwise/numbers.h"
#include "linkwise/sines.h"
#ifdef __cplusplus
extern "C"
#endif
void sines_of(size_t count, const real *angle, real *sine, real *cosine);
void sines_of(size_t count, const real *angle, real *sine, real *cosine)
{
    API(sines)(count, angle, sine, cosine);
}
"""
BUILDS = {
    "gcc": ("gcc", "-std=c99", "-O2", "-ftree-vectorize", "-ffp-contract=fast"),
    "gcc, fused": ("gcc", "-std=c99", "-O2", "-ftree-vectorize", "-ffp-contract=fast", "-mavx2", "-mfma"),
    "gcc, plain": ("gcc", "-std=c99", "-O0"),
    "gcc, fast": ("gcc", "-std=c99", "-O2", "-ffast-math", "-fno-finite-math-only"),
    "g++": ("g++", "-std=c++17", "-O2"),
    "clang": ("clang", "-std=c99", "-O2", "-ffp-contract=fast"),
    "clang, fused": ("clang", "-std=c99", "-O2", "-ffp-contract=fast", "-mavx2", "-mfma"),
}
FURTHEST = {np.float64: 2**19, np.float32: 2**9}
"""Quarter turns up to which angles are reduced in C; the library's functions take larger ones."""
ALMOST_ZERO = {np.float64: 2.0**-67, np.float32: 2.0**-29}


def angles(dtype: type, count: int) -> np.ndarray:
    """Angles of every size, next to and between multiples of a quarter turn, and at the end of the range."""
    random = np.random.default_rng(7)
    sizes = random.choice([0.1, 1.0, 3.0, 10.0, 100.0, FURTHEST[dtype]], count)
    near = random.integers(-FURTHEST[dtype], FURTHEST[dtype], count // 4) * (np.pi / 2)
    near += random.choice([0.0, 1e-12, 1e-6, 1e-3], count // 4)
    odd = (random.integers(-9, 9, count // 8) + 0.5) * (np.pi / 2)
    ends = np.array([FURTHEST[dtype], FURTHEST[dtype] - 0.5, FURTHEST[dtype] - 1]) * (np.pi / 2)
    return np.concatenate(
        [sizes * random.uniform(-1, 1, count), near, odd, ends, -ends, [0.0, 1e-30]]
    ).astype(dtype)


def sines(folder: Path, build: str, angle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Sines and cosines by C, compiled for the type of the angles."""
    compiler, *flags = BUILDS[build]
    if not shutil.which(compiler):
        pytest.skip(f"needs {compiler}")
    if "-mfma" in flags and " fma " not in Path("/proc/cpuinfo").read_text(encoding="ascii"):
        pytest.skip("needs a processor that fuses")
    source = "sines.cpp" if compiler == "g++" else "sines.c"
    (folder / source).write_text(SOURCE, encoding="ascii")
    (folder / "linkwise").mkdir(exist_ok=True)
    for header in ("numbers.h", "sines.h"):
        text = resources.files("linkwise").joinpath("c", header).read_text(encoding="utf-8")
        (folder / "linkwise" / header).write_text(text, encoding="utf-8")
    single = angle.dtype == np.float32
    kind = ["-DLINKWISE_FLOAT"] if single else []
    warned = ["-Wall", "-Wextra", "-Werror", "-pedantic"]
    made = folder / f"{'float' if single else 'double'}.so"
    parts = made.with_suffix(".o")
    run_kept([compiler, *flags, *kind, *warned, "-fPIC", "-c", folder / source], parts)
    # Linked by -ffast-math, a library would have this whole process round what is almost zero to zero.
    run_kept([compiler, "-shared", parts, "-lm"], made)
    function = ctypes.CDLL(str(made)).sines_of
    found = np.full((2, len(angle)), 9.0, angle.dtype)
    function(ctypes.c_size_t(len(angle)), *(ctypes.c_void_p(a.ctypes.data) for a in (angle, *found)))
    return found[0], found[1]


def off(found: np.ndarray, angle: np.ndarray, function: str) -> np.ndarray:
    """Errors in units of the last place, 0 where they are below what results next to zero may be off by."""
    dtype = angle.dtype.type
    with mpmath.workdps(60):
        exact = [getattr(mpmath, function)(mpmath.mpf(float(x))) for x in angle]
        error = np.array([abs(float(mpmath.mpf(float(f)) - e)) for f, e in zip(found, exact, strict=True)])
        unit = np.spacing(np.abs(np.array([float(e) for e in exact])).astype(dtype)).astype(float)
    return np.where((error <= ALMOST_ZERO[dtype]) & (np.abs(angle) > 1), 0.0, error / unit)


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("build", BUILDS)
def test_they_are_off_by_less_than_a_unit_in_the_last_place(build: str, dtype: type, tmp_path: Path) -> None:
    angle = angles(dtype, 4000)
    bound = 4.0 if build == "gcc, fast" else 1.0  # glibc's vector functions promise 4 units
    for function, found in zip(("sin", "cos"), sines(tmp_path, build, angle), strict=True):
        assert off(found, angle, function).max() < bound, function


@pytest.mark.parametrize("dtype", [np.float64, np.float32])
@pytest.mark.parametrize("strange", [1e7, 3e38, np.inf, -np.inf, np.nan])
def test_an_angle_far_away_or_not_finite_spoils_no_other(dtype: type, strange: float, tmp_path: Path) -> None:
    angle = np.linspace(-3, 3, 19).astype(dtype)
    angle[11] = strange
    for function, found in zip(("sin", "cos"), sines(tmp_path, "gcc", angle), strict=True):
        if np.isfinite(strange):
            assert off(found[11:12], angle[11:12], function)[0] < 1
        else:
            assert np.isnan(found[11])
        others = np.arange(19) != 11
        assert off(found[others], angle[others], function).max() < 1


@pytest.mark.parametrize("count", [0, 1, 2, 3, 7, 8, 9, 31])
def test_any_number_of_angles_has_as_many_sines(count: int, tmp_path: Path) -> None:
    """Numbers that lie behind are not touched."""
    angle = np.linspace(-2, 2, 40)
    found = [np.full(40, 9.0), np.full(40, 9.0)]
    sines(tmp_path, "gcc", angle)
    function = ctypes.CDLL(str(tmp_path / "double.so")).sines_of
    function(ctypes.c_size_t(count), *(ctypes.c_void_p(a.ctypes.data) for a in (angle, *found)))
    for values, exact in zip(found, (np.sin(angle), np.cos(angle)), strict=True):
        np.testing.assert_allclose(values[:count], exact[:count], rtol=4e-16)
        assert (values[count:] == 9.0).all()
