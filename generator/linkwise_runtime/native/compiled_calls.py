"""The Python extension module of compiled_calls.c: calls of C without a detour through Python.

It is compiled where Python's and NumPy's headers are; without it, ctypes calls the same functions.
"""

import sys
import sysconfig
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Protocol, cast

import numpy as np

from ..call_table import CALLS
from .build import extension
from .calls import NativeCalls
from .memory import LARGE, NumberArray, NumberType

SOURCE = Path(__file__).with_suffix(".c")

DTYPES = (np.dtype("f8"), np.dtype("f4"))
"""Number types in the order of the compiled module."""

COMPILED = (
    "packed",
    "packed_torque",
    "partial_torque",
    "inverse_dynamics",
    "coefficients",
    "propagation",
    "position_gradient",
)
"""Calls of `Dynamics` that the compiled module has."""
CONVENTIONS = {"propagation": ("closing",), "gradient_propagation": ("gradient",)}
"""Extra arguments of calls that share one name in the compiled module."""


class CompiledCalls(Protocol):
    """An object of the class `Calls` of compiled_calls.c: one robot's calls, by name."""

    def learn(self, call: str, kind: int, address: int) -> None:
        """Store the address of the C function of a call."""


class CompiledClass(Protocol):
    """The class `Calls` of compiled_calls.c."""

    def __call__(
        self,
        n: int,
        most: int,
        doubles: NumberArray,
        floats: NumberArray,
        answers: Mapping[str, tuple[type | None, Sequence[tuple[int, ...]]]],
        /,
    ) -> CompiledCalls:
        """Make one robot's calls.

        most: bytes of results up to which it answers itself
        doubles, floats: values of the parameters
        answers: type of the record and shapes of the results, by call
        """


def headers() -> tuple[str, ...]:
    """Return the folders of the headers; () where one is missing, or this Python cannot load the module."""
    if sys.implementation.name != "cpython" or sysconfig.get_config_var("Py_GIL_DISABLED"):
        return ()
    paths = sysconfig.get_paths()
    python, numpy = dict.fromkeys((paths["include"], paths["platinclude"])), np.get_include()
    there = (Path(paths["include"], "Python.h"), Path(numpy, "numpy", "arrayobject.h"))
    return (*python, numpy) if all(file.is_file() for file in there) else ()


@cache
def compiled_calls() -> CompiledClass | None:
    """Return the class `Calls` of compiled_calls.c, compiled if need be; None where it is not to be had."""
    found = headers()
    if not found:
        return None
    versions = (sys.implementation.cache_tag, np.__version__)
    try:
        path = str(extension(SOURCE, found, versions))
        loader = ExtensionFileLoader(SOURCE.stem, path)
        spec = spec_from_file_location(SOURCE.stem, path, loader=loader)
        assert spec is not None
        module = module_from_spec(spec)
        loader.exec_module(module)
    except (RuntimeError, ImportError, OSError):
        return None
    return cast(CompiledClass, module.Calls)


class QuickCalls:
    """Calls of C through the compiled module, where it exists and has the call, else through ctypes."""

    def __init__(self, calls: NativeCalls) -> None:
        self.calls = calls
        made = compiled_calls()
        # Learned parameters may change from call to call.
        self.compiled = None if made is None or calls.learned else self._made(made)
        self._known: set[tuple[str, NumberType]] = set()

    def _made(self, made: CompiledClass) -> CompiledCalls:
        """Return the compiled module's object for this robot."""
        doubles, floats = (self.calls.constants(kind) for kind in DTYPES)
        shapes = {key: shapes for key, shapes in self.calls.shapes.items() if key in CALLS}
        answers = {key: (CALLS[key].record, shapes) for key, shapes in shapes.items()}
        return made(self.calls.structure.n, LARGE - 1, doubles, floats, answers)

    def direct(self) -> Mapping[str, Callable[..., object]]:
        """Return the compiled module's calls by name; empty without the module."""
        calls = {call: getattr(self.compiled, call) for call in COMPILED} if self.compiled else {}
        for call in calls.values():
            call.__module__ = __name__  # torch.jit asks for a function's module before it calls it
        return calls

    def run(
        self, call: str, motion: Sequence[NumberArray], into: Sequence[NumberArray] | None = None
    ) -> Sequence[NumberArray]:
        """Return a call's results for arrays of one shape, written to `into`, or to new memory."""
        convention = CONVENTIONS.get(call, ())
        if not self.compiled or not (convention or call in COMPILED):
            return self.through_ctypes(call, motion, into)
        several = CALLS[call].record is not None
        out = into if into is None else tuple(into) if several else into[0]
        name = CALLS[call].name
        answer = getattr(self.compiled, name)(self, *motion, *convention, out)
        results: Sequence[NumberArray] = answer if several else (answer,)
        return results

    def through_ctypes(
        self, call: str, motion: Sequence[NumberArray], into: Sequence[NumberArray] | None = None
    ) -> Sequence[NumberArray]:
        """Return a call's results by ctypes; tell the compiled module the address of a function new to it."""
        results = self.calls.run(call, motion, into)
        kind = motion[0].dtype
        if self.compiled and (call, kind) not in self._known and motion[0].size:
            self._known.add((call, kind))
            self.compiled.learn(call, DTYPES.index(kind), self.calls.address(call, kind))
        return results


def _passed_on(name: str) -> Callable[..., object]:
    """Return the method that the compiled module calls where it has no answer.

    The method takes the motion, and then the arrays for results, or None.
    """

    def passed_on(self: QuickCalls, *given: object) -> object:
        *motion, out = given
        call = name
        if name == "propagation":
            call = {"closing": name, "gradient": "gradient_propagation"}[cast(str, motion.pop())]
        several = CALLS[call].record is not None
        into = out if several or out is None else [out]
        arrays = cast("Sequence[NumberArray]", motion)
        results = self.through_ctypes(call, arrays, cast("Sequence[NumberArray] | None", into))
        return results if several else results[0]

    return passed_on


for _name in COMPILED:
    setattr(QuickCalls, _name, _passed_on(_name))
