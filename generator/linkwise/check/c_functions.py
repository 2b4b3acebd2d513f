"""Checks of every function that a package's C must have, in double and float, against the reference."""

import math
import re
from collections.abc import Iterator, Mapping
from itertools import product
from pathlib import Path

import numpy as np

from linkwise.arrays import Array, Index
from linkwise.check.compare import Entries, IndexRows, Result, compare, is_short_of_memory, packed, skipped
from linkwise.check.compiled_c import CompiledPackage, Numbers, Prototype, wrong_header
from linkwise.check.control_functions import (
    CONTROL,
    NOT_CALLED,
    cancel_calls,
    control_calls,
    control_prototypes,
    impedance_calls,
    impedance_prototypes,
)
from linkwise.check.frame_checks import FrameReference
from linkwise.check.model_calls import FLOAT32
from linkwise.check.tied_functions import OF_TIES, tied_constants, tied_prototypes
from linkwise.check.variance_functions import (
    BY_BODIES,
    BY_MOTION,
    FACTOR,
    VARIED,
    Uncertain,
    body_variances,
    motion_calls,
)
from linkwise.check.variance_functions import OUTPUTS as UNCERTAIN
from linkwise.errors import LinkwiseError
from linkwise.oracle.reference import Reference, dense_quantities
from linkwise.oracle.states import NUMBERS
from linkwise.package.manifest import Manifest

ROWS, BLOCKS = (0, 1, 7, 8, 9, 17, 139), (1, 2, 11)
"""Numbers of samples, and of blocks: none, one, some that fill no block, some that do, more than a tile."""

OUTPUTS = ("c2", "c1", "g", "tau", "h1")
"""Arrays of a decomposition, in the order of the arguments."""

DENSE = {
    "partial_torque": (("tau",), ("torque",)),
    "inverse_dynamics": (("sums",), ("torque",)),
    "coefficients": (("c2", "c1", "g"), ("acceleration", "velocity", "gravity")),
    "propagation": (("c2 qdd", "c1 qd", "g"), ("acceleration", "velocity", "gravity")),
    "gradient_propagation": (("c2 qdd", "slopes qd", "g"), ("acceleration", "velocity", "gravity")),
    "dense_position_gradient": (("c0",), ("gradient",)),
}
"""Functions whose results include zeros: their quantities, and the names of these in the header."""

REGRESSORS = {
    "regressor": (("Y",), ("regressor",)),
    "coefficient_regressors": (("Y c2", "Y c1", "Y g"), ("acceleration", "velocity", "gravity")),
}
"""Functions of robots of rigid links alone whose results include zeros: quantities, and names in the
header."""

REACTIONS = {
    "reactions": (("acceleration", "velocity", "gravity"), ("acceleration", "velocity", "gravity")),
}
"""Functions of robots of rigid links that no ties hold: quantities, and names in the header."""

AT_REST = ("coefficients", "coefficient_regressors", "reactions")
"""Functions that take no qdd."""

MOST = 16
"""Most samples in one call of a function of a large robot: one block, or rows that fill none."""
MANY = 192
"""Bytes per result of a sample up to which results count as few: 24 samples in double, 48 in float."""


class CFunctions:
    """A package's compiled C for given parameters, and the indices of its results."""

    def __init__(
        self, manifest: Manifest, compiled: CompiledPackage, rows: IndexRows, parameters: Mapping[str, float]
    ) -> None:
        self.manifest, self.rows, self.compiled = manifest, rows, compiled
        self.n = len(manifest.joints)
        self.parameters = np.array([parameters[name] for name in manifest.parameters])
        self.functions = prototypes(manifest, rows)

    def torque(self, q: Array, qd: Array, qdd: Array) -> Array:
        """Return dense τ_ij (samples, n, N) from the C function for torques alone, in double."""
        function = next(f for f in self.functions if f.name == "torque")
        given = {"q": q, "qd": qd, "qdd": qdd, "p": self.parameters}
        found = self.compiled.call(function, len(q), given, {"tau": len(q) * len(self.rows.tau)}, 0)
        dense = np.full((len(q), self.n, len(self.manifest.links)), np.nan if found is None else 0.0)
        if found is not None:
            dense[(slice(None), *self.rows.tau.T)] = found["tau"].reshape(len(q), -1)
        return dense

    def check(
        self,
        label: str,
        reference: Reference,
        regressors: Reference | None,
        wrenches: Reference | None,
        frames: FrameReference | None,
        moved: Uncertain | None,
    ) -> Iterator[Result]:
        """Yield one result per function; `label` stands before its name.

        Links of energies have no regressors, no wrenches and no frames.
        """
        for function in self.functions:
            symbol = f"{self.manifest.name}_{function.name}"
            name = f"{label}: {symbol}"
            if not hasattr(self.compiled.library, symbol):
                yield Result(name, False, None, "there is no such function")
                continue
            if function.short in (NOT_CALLED, *OF_TIES):
                continue
            single = FLOAT32 if function.real == "float" else {"tolerance": reference.tolerance}
            try:
                if function.short in REGRESSORS:
                    calls = self._of_bodies(function, regressors)
                elif function.short == BY_BODIES:
                    calls = body_variances(self._call, function, self.rows, regressors, ROWS[:-1])
                elif function.short == BY_MOTION:
                    calls = motion_calls(self._call, function, self._width(function), self.rows, moved)
                elif function.short in REACTIONS:
                    calls = self._of_bodies(function, wrenches)
                elif function.short.endswith("partial_impedance"):
                    calls = impedance_calls(self._call, function, self.manifest, reference)
                elif function.short == "cancel":
                    calls = cancel_calls(self._call, function, self.manifest, reference)
                elif function.short in CONTROL:
                    calls = control_calls(self._call, function, self.manifest, reference, frames)
                else:
                    calls = self._calls(function, reference)
                yield compare(name, calls, **single)
            except _OutOfBounds as error:
                yield Result(name, False, None, f"{error.args[0]} wrote beyond its arrays")

    def _calls(self, function: Prototype, reference: Reference) -> Iterator[Entries]:
        """Yield results of a function for several numbers of samples, outputs on a cache line and off it."""
        link = re.fullmatch(r"link_(\d+)", function.short)
        if link:
            yield from self._link(function, reference, int(link[1]) - 1)
            return
        if function.short in DENSE:
            yield from self._dense(function, reference, dense_quantities(reference))
            return
        width = self._width(function)
        results = sum(len(self.rows.of(what)) for what in function.outputs)
        most = max(MOST, NUMBERS // max(results, 1))
        for count in BLOCKS if width > 1 else ROWS:
            if count * width > most:
                continue
            at = np.arange(count * width) * 3 % max(len(reference.states.q), 1)
            for shift in (0, 1):
                yield from self._rows(function, reference, at, width, shift)

    def _width(self, function: Prototype) -> int:
        """Return the number of samples that a function takes at a time."""
        if not function.short.endswith("_blocks"):
            return 1
        return self.compiled.constants["BLOCKF" if function.real == "float" else "BLOCK"]

    def _rows(
        self, function: Prototype, reference: Reference, at: Index, width: int, shift: int
    ) -> Iterator[Entries]:
        sizes = {what: len(self.rows.of(what)) for what in function.outputs}
        motion = zip(("q", "qd", "qdd"), reference.states.at(at).motion, strict=True)
        given = {what: _blocks(x, width) for what, x in motion}
        found = self._call(
            function, len(at) // width, given, {k: len(at) * v for k, v in sizes.items()}, shift
        )
        for what, size in sizes.items():
            flat = found[what].reshape(len(at) // width, size, width).swapaxes(1, 2).reshape(len(at), size)
            yield packed(what, flat, self.rows.of(what), reference, at)

    def _dense(
        self, function: Prototype, reference: Reference, expected: Mapping[str, tuple[Array, Array]]
    ) -> Iterator[Entries]:
        """Yield results of a function whose results include zeros."""
        what, names = (DENSE | REGRESSORS | REACTIONS)[function.short]
        shapes = [expected[quantity][0].shape[1:] for quantity in what]
        most = max(1, NUMBERS // max(map(math.prod, shapes)))
        for count, shift in product((count for count in ROWS if count <= most), (0, 1)):
            at = np.arange(count) * 3 % max(len(reference.states.q), 1)
            given = dict(zip(("q", "qd", "qdd"), reference.states.at(at).motion, strict=True))
            sizes = {name: count * math.prod(shape) for name, shape in zip(names, shapes, strict=True)}
            found = self._call(function, count, given, sizes, shift)
            for quantity, name, shape in zip(what, names, shapes, strict=True):
                values, scales = (source[at] for source in expected[quantity])
                yield Entries(quantity, found[name].reshape(count, *shape), values, scales)

    def _of_bodies(self, function: Prototype, reference: Reference | None) -> Iterator[Entries]:
        if reference is not None:
            expected = {what: (value, reference.scales[what]) for what, value in reference.values.items()}
            yield from self._dense(function, reference, expected)

    def _link(self, function: Prototype, reference: Reference, link: int) -> Iterator[Entries]:
        own = {what: self.rows.of(what)[self.rows.of(what)[:, 1] == link] for what in function.outputs}
        for row in range(0, len(reference.states.q), max(1, len(reference.states.q) // 8)):
            motion = zip(("q", "qd", "qdd"), reference.states.at(row).motion, strict=True)
            found = self._call(function, 1, dict(motion), {k: len(v) for k, v in own.items()}, row % 2)
            for what, rows in own.items():
                yield packed(what, found[what][None], rows, reference, np.array([row]))

    def _call(
        self,
        function: Prototype,
        count: int,
        given: Mapping[str, Numbers | None],
        sizes: Mapping[str, int],
        shift: int,
    ) -> dict[str, Numbers]:
        found = self.compiled.call(function, count, {**given, "p": self.parameters}, sizes, shift)
        if found is None:
            raise _OutOfBounds(function.name)
        return found


class _OutOfBounds(Exception):
    """Error of a function that wrote beyond its arrays."""


def prototypes(manifest: Manifest, rows: IndexRows) -> list[Prototype]:
    """Return the functions that a package's header must declare, by the manifest's links and parameters."""
    inputs = ("q", "qd", "qdd", *(["p"] if manifest.parameters else []))
    every = tuple(what for what in OUTPUTS if len(rows.of(what)))
    rigid = REGRESSORS if manifest.tree is not None else {}
    rigid = rigid | REACTIONS if rigid and not manifest.tied else rigid
    functions = [
        ("decomposition", "count", every),
        ("decomposition_blocks", "blocks", every),
        ("torque", "count", ("tau",)),
        ("position_gradient", "count", ("c0",)),
        *((name, "count", outputs) for name, (_, outputs) in (DENSE | rigid).items()),
        *([(BY_BODIES, "count", tuple(VARIED)), (BY_MOTION, "blocks", UNCERTAIN)] if rigid else []),
    ]
    for j in range(len(manifest.links)):
        own = tuple(what for what in every if j in rows.of(what)[:, 1])
        functions.append((f"link_{j + 1}", "", own))
    kinds = (("double", ""), ("float", "f"))
    every_kind = [
        Prototype(name + suffix, real, counted, _inputs(name, inputs), outputs)
        for real, suffix in kinds
        for name, counted, outputs in functions
    ]
    if manifest.tree is not None:
        every_kind += [f for real, suffix in kinds for f in control_prototypes(manifest, real, suffix)]
    for real, suffix in kinds:
        every_kind += impedance_prototypes(manifest, real, suffix)
        every_kind += tied_prototypes(manifest, real, suffix)
    return every_kind


def _inputs(name: str, every: tuple[str, ...]) -> tuple[str, ...]:
    """Return the arrays that a function reads: coefficients do not depend on qdd."""
    return (*(what for what in every if name not in AT_REST or what != "qdd"), *FACTOR.get(name, ()))


def compile_c(manifest: Manifest, directory: Path, rows: IndexRows) -> tuple[CompiledPackage | None, Result]:
    """Compile a package's C, and check its headers against the manifest's paths.

    The check covers every number, every index, and every function with its arguments, by name. Returns None
    in place of the C where it cannot be compiled.
    """
    results = sum(len(rows.of(what)) for what in ("c2", "c1", "g", "tau", "h1"))
    try:
        compiled = CompiledPackage(manifest.name, directory / "c", MANY * results)
    except (RuntimeError, LinkwiseError, OSError) as error:
        told = " ".join(str(error).split())
        if isinstance(error, RuntimeError) or is_short_of_memory(error):
            return None, skipped("c: not checked", told)
        return None, Result("c: compiles", False, None, told)
    functions = prototypes(manifest, rows)
    wrong = wrong_header(manifest, compiled, directory, rows, functions, tied_constants(manifest))
    detail = wrong or "as the manifest's paths say"
    return compiled, Result(
        "c: numbers, indices, types and functions of the headers", not wrong, None, detail
    )


def _blocks(motion: Array, width: int) -> Array:
    """Return samples (count, n) in blocks of `width`, samples innermost; rows for a width of 1."""
    return motion.reshape(-1, width, motion.shape[-1]).swapaxes(1, 2)
