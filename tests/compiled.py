"""The emitted C, compiled strictly and called through the functions of its header."""

import ctypes
import json
import re
import subprocess
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

FLAGS = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-O1", "-fPIC")


def compile_library(directory: Path, target: Path, compiler: str = "gcc") -> None:
    """Compile the package's C files to a shared library; any warning fails."""
    sources = sorted(str(path) for path in (directory / "c").glob("*.c"))
    command = [compiler, *FLAGS, "-shared", "-o", str(target), *sources, "-lm"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


class Compiled:
    """The compiled functions of a package, on arrays (samples, n) of float64 or float32."""

    def __init__(self, directory: Path, parameters: Sequence[float] = ()) -> None:
        self.parameters = list(parameters)
        self.name = json.loads((directory / "manifest.json").read_text())["name"]
        header = (directory / "c" / f"{self.name}.h").read_text()
        sizes = dict(re.findall(r"([A-Z0-9_]+) = (\d+)", header))
        prefix = self.name.upper()
        keys = {"acceleration": "C2", "velocity": "C1", "gravity": "G", "torque": "G", "linear": "H1"}
        self.sizes = {field: int(sizes[f"{prefix}_{key}"]) for field, key in keys.items()}
        with tempfile.TemporaryDirectory() as folder:
            target = Path(folder) / f"{self.name}.so"
            compile_library(directory, target)
            self.library = ctypes.CDLL(str(target))

    def _call(self, function: str, motion: tuple[Any, ...], widths: list[int]) -> list[Any]:
        dtype = motion[0].dtype
        suffix, real = ("f", ctypes.c_float) if dtype == np.float32 else ("", ctypes.c_double)
        outputs = [np.full((len(motion[0]), width), np.nan, dtype) for width in widths]
        p = np.array(self.parameters, dtype) if self.parameters else None
        arrays = [*(np.ascontiguousarray(m) for m in motion), p, *outputs]
        pointers = [a if a is None else a.ctypes.data_as(ctypes.POINTER(real)) for a in arrays]
        entry = getattr(self.library, f"{self.name}_{function}{suffix}")
        entry.restype = None
        entry(ctypes.c_size_t(len(motion[0])), *pointers)
        return outputs

    def decomposition(self, *motion: Any) -> dict[str, Any]:
        """Packed c2, c1, g, tau and the linear part of c1."""
        return dict(
            zip(self.sizes, self._call("decomposition", motion, list(self.sizes.values())), strict=True)
        )

    def torque(self, *motion: Any) -> Any:
        """Packed tau."""
        return self._call("torque", motion, [self.sizes["torque"]])[0]

    def position_gradient(self, *motion: Any) -> Any:
        """Packed c0."""
        return self._call("position_gradient", motion, [self.sizes["velocity"]])[0]
