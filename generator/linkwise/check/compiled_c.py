"""A package's C, compiled here and called through the functions that it must have."""

import ctypes
import re
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from linkwise_runtime.native.build import require_stack
from linkwise_runtime.native.compiler import Compiler, find_compiler
from linkwise_runtime.native.process import run_all
from linkwise_runtime.native.system import system_here
from numpy.typing import NDArray

from linkwise.errors import LinkwiseError

Numbers = NDArray[Any]

FLAGS = ("-std=c99", "-O0")
"""Flags for quick compilation; the native back end, compared with the same reference, has its own."""

GUARD = 4096
"""Bytes before and after each output, which nothing may write to."""
LINE = 64
"""Bytes of a cache line; half of the calls write to arrays that start on one."""


@dataclass(frozen=True)
class Prototype:
    """A function of the header: its name without the package's, its number type, and its arrays in order.

    counted: name of the argument that gives the number of samples or blocks, or the frame; empty for none
    kinds: inputs that are not of the number type, and their types
    """

    name: str
    real: str
    counted: str
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    returns: str = "void"
    kinds: tuple[tuple[str, str], ...] = ()

    def declaration(self, package: str) -> str:
        """Return the prototype on one line."""
        kind = "int" if self.counted == "frame" else "size_t"
        counts = [f"{kind} {self.counted}"] if self.counted else []
        kinds = dict(self.kinds)
        inputs = [f"const {kinds.get(array, self.real)} *{array}" for array in self.inputs]
        outputs = [f"{self.real} *{array}" for array in self.outputs]
        return f"{self.returns} {package}_{self.name}({', '.join([*counts, *inputs, *outputs])});"

    @property
    def dtype(self) -> np.dtype[Any]:
        """NumPy's data type for its numbers."""
        return np.dtype(np.float32 if self.real == "float" else np.float64)

    @property
    def short(self) -> str:
        """Name without the f of single precision."""
        return self.name.removesuffix("f") if self.real == "float" else self.name


class CompiledPackage:
    """The functions of a package's NAME.c and NAMEf.c; arrays in, arrays out, guards around every output.

    large: bytes of results above which they bypass the cache, far fewer here, so that this path is tried
    """

    def __init__(self, name: str, directory: Path, large: int) -> None:
        """Compile and load the C of a package.

        Raises LinkwiseError for sources that do not compile, RuntimeError where none can be compiled or run
        here.
        """
        require_stack(name, directory)
        self.header = (directory / f"{name}.h").read_text(encoding="utf-8")
        self.name = name
        self.constants = _constants(name, self.header)
        # Some systems keep a library, and its folder, for as long as it is loaded.
        with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
            library = Path(folder) / f"checked{system_here().library}"
            sources = [directory / f"{name}.c", directory / f"{name}f.c"]
            _compile(find_compiler(), sources, library, large)
            self.library = ctypes.CDLL(str(library))

    def call(
        self,
        function: Prototype,
        count: int,
        given: Mapping[str, Numbers | None],
        sizes: Mapping[str, int],
        shift: int,
    ) -> dict[str, Numbers] | None:
        """Return outputs of the given sizes, flat; None where the function wrote beyond one of them.

        count: samples, blocks or a frame's number; given: arrays by name, None for NULL
        shift: how many numbers each output starts behind a cache line
        """
        read = [given[name] for name in function.inputs]
        inputs = [None if a is None else np.ascontiguousarray(a, function.dtype) for a in read]
        guarded = [_Guarded(sizes[name], function.dtype, shift) for name in function.outputs]
        entry = getattr(self.library, f"{self.name}_{function.name}")
        entry.restype = None if function.returns == "void" else ctypes.c_int
        kind = ctypes.c_int if function.counted == "frame" else ctypes.c_size_t
        counts = [kind(count)] if function.counted else []
        arrays = (*inputs, *(g.array for g in guarded))
        pointers = [ctypes.c_void_p(None if a is None else a.ctypes.data) for a in arrays]
        entry(*counts, *pointers)
        if not all(g.whole for g in guarded):
            return None
        return {name: g.array for name, g in zip(function.outputs, guarded, strict=True)}


class _Guarded:
    """An array of NaN between two stretches of memory that must stay unchanged."""

    def __init__(self, size: int, dtype: np.dtype[Any], shift: int) -> None:
        self._memory = np.full(2 * GUARD + LINE + (size + shift) * dtype.itemsize, 0xA5, np.uint8)
        start = GUARD + -(self._memory.ctypes.data + GUARD) % LINE + shift * dtype.itemsize
        self._inside = slice(start, start + size * dtype.itemsize)
        self.array = self._memory[self._inside].view(dtype)
        self.array[:] = np.nan

    @property
    def whole(self) -> bool:
        """True if nothing outside the array was written to."""
        around = self._memory[: self._inside.start], self._memory[self._inside.stop :]
        return all(bool((outside == 0xA5).all()) for outside in around)


def _constants(name: str, header: str) -> dict[str, int]:
    found = re.findall(rf"\b{re.escape(name.upper())}_(\w+) = (\d+)", header)
    return {key: int(value) for key, value in found}


def declarations(name: str, header: str) -> dict[str, str]:
    """Return the declaration of each of the package's functions in a header, on one line, by name in C."""
    code = " ".join(re.sub(r'/\*.*?\*/|"[^"\n]*"', " ", header, flags=re.DOTALL).split())
    found = re.finditer(rf"[^;{{}}]*\b({re.escape(name)}_\w+) *\([^;]*;", code)
    return {statement[1]: statement[0].strip() for statement in found}


def _compile(compiler: Compiler, sources: Sequence[Path], library: Path, large: int) -> None:
    """Compile both number types side by side, then link them into one library."""
    flags = (*FLAGS, *compiler.tuning, *compiler.anywhere)
    objects = [library.with_name(f"{source.name}.o") for source in sources]
    commands = [
        [*compiler.command, *flags, f"-DLARGE={large}", "-c", str(source), "-o", str(made)]
        for source, made in zip(sources, objects, strict=True)
    ]
    linking = compiler.linking([*map(str, objects)], str(library))
    try:
        run_all(commands, lambda _: None)
        run_all([linking], lambda _: None)
    except RuntimeError as error:
        raise LinkwiseError(str(error)) from None
