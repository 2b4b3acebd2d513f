"""The emitted C, compiled strictly and called through the functions of its header."""

import ctypes
import json
import math
import re
import tempfile
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from helpers.kept import run_kept

WARNED = ("-Wall", "-Wextra", "-Werror", "-pedantic", "-fPIC")
STRICT = (*WARNED, "-O1")
PARTS = ("SINES", "ONE_SAMPLE", "BLOCKS", "POSITION_GRADIENT", "CONTROL", "CONSTRAINTS")
"""Parts of the C that may be compiled apart."""
FIELDS = {"c2": "acceleration", "c1": "velocity", "g": "gravity", "tau": "torque", "h1": "linear"}
"""Names in the Python API of the arrays of the header."""


def name_of(directory: Path) -> str:
    """Name of the package in a directory."""
    return str(json.loads((directory / "manifest.json").read_text())["name"])


def compile_library(
    directory: Path, target: Path, compiler: Sequence[str] = ("gcc", "-std=c99"), level: str = "-O0"
) -> None:
    """Compile the package's double and float to a shared library; any warning fails."""
    run_kept([*compiler, *WARNED, level, "-shared", *sources(directory), "-lm"], target)


def check_syntax(directory: Path, compiler: Sequence[str]) -> None:
    """Read the package's double and float; a warning that needs no optimisation fails: clang has no other."""
    for source in sources(directory):
        run_kept([*compiler, *WARNED, "-fsyntax-only", source])


def link_parts(directory: Path, compiler: Sequence[str], folder: Path) -> None:
    """Compile the package's double part by part, without optimisation, and link them; any warning fails."""
    objects = [folder / f"{part}.o" for part in PARTS]
    source = sources(directory)[0]
    for part, made in zip(PARTS, objects, strict=True):
        run_kept([*compiler, *WARNED, "-O0", f"-DLINKWISE_PART={part}", "-c", source], made)
    run_kept([compiler[0], "-shared", "-Wl,--no-undefined", *objects, "-lm"], folder / "all.so")


def sources(directory: Path) -> list[str]:
    """Files of a package that are compiled, in double and in float."""
    name = name_of(directory)
    return [str(directory / "c" / file) for file in (f"{name}.c", f"{name}f.c")]


@cache
def library_of(directory: Path) -> ctypes.CDLL:
    """Return the library of a package that no test changes: compiled once, with warnings of optimisation."""
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder) / f"{name_of(directory)}.so"
        compile_library(directory, target, level="-O1")
        return ctypes.CDLL(str(target))


class Compiled:
    """The compiled functions of a package, on arrays (samples, n) of float64 or float32."""

    def __init__(
        self, directory: Path, parameters: Sequence[float] = (), library: Path | None = None
    ) -> None:
        self.parameters = list(parameters)
        self.name = name_of(directory)
        header = (directory / "c" / f"{self.name}.h").read_text()
        self.numbers = {
            key: int(value) for key, value in re.findall(rf"{self.name.upper()}_(\w+) = (\d+)", header)
        }
        totals = {"tau": "G"}
        self.sizes = {array: self.numbers.get(totals.get(array, array.upper()), 0) for array in FIELDS}
        self.library = ctypes.CDLL(str(library)) if library else library_of(directory)

    def _call(self, function: str, count: int | None, motion: Sequence[Any], lengths: list[int]) -> list[Any]:
        """Arrays of the given lengths that a function fills; those of length 0 it does not have."""
        dtype = motion[0].dtype
        suffix, real = ("f", ctypes.c_float) if dtype == np.float32 else ("", ctypes.c_double)
        outputs = [np.full(length, np.nan, dtype) for length in lengths]
        p = [np.array(self.parameters, dtype)] if self.parameters else []
        arrays = [*map(np.ascontiguousarray, motion), *p, *(a for a in outputs if a.size)]
        pointers = [a.ctypes.data_as(ctypes.POINTER(real)) for a in arrays]
        entry = getattr(self.library, f"{self.name}_{function}{suffix}")
        entry.restype = None
        entry(*([] if count is None else [ctypes.c_size_t(count)]), *pointers)
        return outputs

    def _rows(self, function: str, motion: tuple[Any, ...], widths: list[int]) -> list[Any]:
        samples = len(motion[0])
        outputs = self._call(function, samples, motion, [samples * width for width in widths])
        return [a.reshape(samples, width) for a, width in zip(outputs, widths, strict=True)]

    def decomposition(self, *motion: Any) -> dict[str, Any]:
        """Packed c2, c1, g, tau and the linear part of c1."""
        outputs = self._rows("decomposition", motion, list(self.sizes.values()))
        return dict(zip(FIELDS.values(), outputs, strict=True))

    def decomposition_of_blocks(self, *motion: Any) -> dict[str, Any]:
        """Return the same coefficients, through the function on blocks of samples."""
        width = self.numbers["BLOCK" if motion[0].dtype == np.float64 else "BLOCKF"]
        blocks, n = len(motion[0]) // width, motion[0].shape[-1]
        inside = [m.reshape(blocks, width, n).swapaxes(1, 2) for m in motion]
        lengths = [blocks * width * size for size in self.sizes.values()]
        outputs = self._call("decomposition_blocks", blocks, inside, lengths)
        rows = [
            a.reshape(blocks, size, width).swapaxes(1, 2).reshape(blocks * width, size)
            for a, size in zip(outputs, self.sizes.values(), strict=True)
        ]
        return dict(zip(FIELDS.values(), rows, strict=True))

    def link(self, number: int, lengths: Sequence[int], *motion: Any) -> list[Any]:
        """Results of one link, counted from 1, for one sample: arrays of the given lengths."""
        return self._call(f"link_{number}", None, motion, list(lengths))

    def torque(self, *motion: Any) -> Any:
        """Packed tau."""
        return self._rows("torque", motion, [self.sizes["tau"]])[0]

    def dense(self, function: str, motion: Sequence[Any], shapes: Sequence[tuple[int, ...]]) -> list[Any]:
        """Results of a function that writes zeros too, of these shapes a sample."""
        rows = self._rows(function, tuple(motion), [math.prod(shape) for shape in shapes])
        return [a.reshape(len(motion[0]), *shape) for a, shape in zip(rows, shapes, strict=True)]

    def position_gradient(self, *motion: Any) -> Any:
        """Packed c0."""
        return self._rows("position_gradient", motion, [self.sizes["c1"]])[0]
