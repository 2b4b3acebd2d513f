"""A package's C, compiled here: its headers against the manifest, and calls of its functions."""

import ctypes
import math
import re
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from linkwise_runtime.native.build import require_stack
from linkwise_runtime.native.compiler import Compiler, find_compiler
from linkwise_runtime.native.process import run_all
from linkwise_runtime.native.system import system_here
from numpy.typing import NDArray

from linkwise.check.compare import IndexRows
from linkwise.check.header_types import wrong_type
from linkwise.check.table_numbers import wrong_numbers
from linkwise.errors import LinkwiseError
from linkwise.escape import identifiers
from linkwise.package.manifest import Manifest

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

        Outputs without a size are NULL.

        count: samples, blocks or a frame's number; given: arrays by name, None for NULL
        shift: how many numbers each output starts behind a cache line
        """
        read = [given[name] for name in function.inputs]
        inputs = [None if a is None else np.ascontiguousarray(a, function.dtype) for a in read]
        outputs = [(name, sizes.get(name)) for name in function.outputs]
        guarded = {name: _Guarded(size, function.dtype, shift) for name, size in outputs if size is not None}
        entry = getattr(self.library, f"{self.name}_{function.name}")
        entry.restype = None if function.returns == "void" else ctypes.c_int
        kind = ctypes.c_int if function.counted == "frame" else ctypes.c_size_t
        counts = [kind(count)] if function.counted else []
        written = [guarded[name].array if name in guarded else None for name in function.outputs]
        arrays = (*inputs, *written)
        pointers = [ctypes.c_void_p(None if a is None else a.ctypes.data) for a in arrays]
        entry(*counts, *pointers)
        if not all(g.whole for g in guarded.values()):
            return None
        return {name: g.array for name, g in guarded.items()}


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
    """Return the declaration of each of the package's functions in a header, on one line, by name in C.

    Types of functions are not among them.
    """
    code = " ".join(re.sub(r'/\*.*?\*/|"[^"\n]*"', " ", header, flags=re.DOTALL).split())
    found = re.finditer(rf"[^;{{}}]*\b({re.escape(name)}_\w+) *\([^;]*;", code)
    told = {statement[1]: statement[0].strip() for statement in found}
    return {function: text for function, text in told.items() if not text.startswith("typedef ")}


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


LIMITS = {"lower": -math.inf, "upper": math.inf, "velocity": math.inf, "effort": math.inf}
"""Arrays of the joints' limits, and the value that stands for no limit."""


def wrong_header(
    manifest: Manifest,
    compiled: CompiledPackage,
    directory: Path,
    rows: IndexRows,
    functions: Iterable[Prototype],
    constants: Mapping[str, int],
) -> str:
    """Return the first number, index, name, limit, type, function or table unlike the manifest's, or nothing.

    constants: those of every robot of its kind, beside its own
    """
    return (
        _wrong_number(manifest, compiled, rows, constants)
        or _wrong_table(manifest, directory, rows)
        or _wrong_joint(manifest, compiled.header)
        or _wrong_function(manifest.name, compiled.header, functions)
        or wrong_type(manifest, compiled.header)
        or _wrong_robot(manifest, directory)
    )


def _wrong_number(
    manifest: Manifest, compiled: CompiledPackage, rows: IndexRows, constants: Mapping[str, int]
) -> str:
    sizes = {what.upper(): len(rows.of(what)) for what in ("c2", "c1", "g", "h1")}
    expected = {"JOINTS": len(manifest.joints), "LINKS": len(manifest.links), "BLOCK": 8, "BLOCKF": 16}
    expected |= {key: size for key, size in sizes.items() if size or key != "H1"}
    expected |= {"PARAMETERS": len(manifest.parameters)} if manifest.parameters else {}
    expected |= constants
    if manifest.tree is not None:
        names = [frame.name for frame in manifest.tree.frames]
        numbers = {key: f for f, key in enumerate(identifiers(names, "FRAME_"))}
        expected |= {"FRAMES": len(names)} | numbers
    wrong = sorted(set(expected.items()) ^ set(compiled.constants.items()))
    return f"{wrong[0][0]} is wrong" if wrong else ""


def _wrong_robot(manifest: Manifest, directory: Path) -> str:
    if manifest.tree is None:
        return ""
    text = (directory / "c" / f"{manifest.name}_tree.h").read_text(encoding="utf-8")
    return wrong_numbers(manifest.tree, text)


def _wrong_table(manifest: Manifest, directory: Path, rows: IndexRows) -> str:
    text = (directory / "c" / f"{manifest.name}_index.h").read_text(encoding="utf-8")
    name = re.escape(manifest.name)
    for what in ("c2", "c1", "g", "h1"):
        size = f"{name.upper()}_{what.upper()}"
        head = rf"static const short {name}_{what}_index\[{size}\]\[{rows.of(what).shape[1]}\]"
        body = re.search(rf"^{head} = \{{(.*?)\n\}};", text, re.DOTALL | re.MULTILINE)
        expected, written = rows.of(what) + 1, body[1] if body else ""
        row = r"\{" + ", ".join([r"[1-9]\d*"] * expected.shape[1]) + r"\}"
        numbers = re.sub(r"[{}]", "", ",".join(re.findall(row, written)))
        listed = np.fromstring(numbers, dtype=int, sep=",")
        if re.sub(row, "", written).strip(" ,\n") or not np.array_equal(listed, expected.ravel()):
            return f"the indices of {what} are wrong"
    return ""


def _wrong_function(name: str, header: str, functions: Iterable[Prototype]) -> str:
    expected = {f"{name}_{f.name}": f.declaration(name) for f in functions}
    found = declarations(name, header)
    wrong = [
        *(f"{function} is not declared" for function in expected.keys() - found.keys()),
        *(f"{function} is declared, and there is no such function" for function in found.keys() - expected),
        *(
            f"{function} is declared otherwise"
            for function, text in expected.items()
            if found.get(function, text) != text
        ),
    ]
    return "; ".join(sorted(wrong)[:3])


def _wrong_joint(manifest: Manifest, header: str) -> str:
    """Return what is wrong with the joints' names and limits; empty if nothing."""
    size = rf"\[{re.escape(manifest.name.upper())}_JOINTS\] = \{{(.*?)\}};"
    named = re.search(rf"\b{re.escape(manifest.name)}_joint_names{size}", header, re.DOTALL)
    names = [_decoded(text) for text in re.findall(r'"((?:[^"\\]|\\.)*)"', named[1])] if named else []
    if names != [joint.name for joint in manifest.joints]:
        return "the names of the joints are wrong"
    for what, none in LIMITS.items():
        found = re.search(rf"\b{re.escape(manifest.name)}_{what}_limit{size}", header)
        limits = [float(text.replace("HUGE_VAL", "inf")) for text in found[1].split(",")] if found else []
        given = [getattr(joint, what) for joint in manifest.joints]
        if limits != [none if limit is None else limit for limit in given]:
            return f"the {what} limits are wrong"
    return ""


def _decoded(text: str) -> str:
    """Return the text of a C string literal whose only escapes are octal ones of UTF-8."""
    plain = re.sub(r"\\([0-7]{3})", lambda found: chr(int(found[1], 8)), text)
    return plain.encode("latin-1", "replace").decode("utf-8", "replace")
