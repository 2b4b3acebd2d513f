"""Values of the run-time parameters: checked to be known by name, real numbers, and possible for a body."""

import math
import sys
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from numbers import Real
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np
from numpy.typing import NDArray

from .chosen_names import MOST_NAMES, choice, plain, short
from .interface import Numbers

if TYPE_CHECKING:
    # As in interface.py: without torch, tensors are Any.
    from torch import Tensor  # type: ignore[import-not-found, unused-ignore]

Value = float | NDArray[np.float64]
"""A number for all samples, or an array with one for each."""

TRIANGLE = 1e-6
"""Relative slack of the triangle inequality: files round flat bodies' moments to about six digits."""
SPECK = 1e-14
"""Area in m^2: moments of inertia below mass times this count as zero; those of a point mass are rounding
errors."""


@dataclass(frozen=True)
class ParametricBody:
    """A link whose mass and inertia depend on parameters."""

    link: str
    parameters: tuple[str, ...]
    """Names of the parameters on which they depend."""
    mass_and_inertia: Callable[[Mapping[str, Any]], Sequence[Any]]
    """Function of the parameters that returns the mass in kg and xx, yy, zz, xy, xz, yz of the inertia about
    the centre of mass in kg m^2, in any axes."""


def checked_values(
    own: Mapping[str, float], given: Mapping[str, object], bodies: Sequence[ParametricBody]
) -> dict[str, float | Numbers]:
    """Return all parameters, `given` values in place of `own` ones; raise as the package's `load` says."""
    if not given:
        return dict(own)
    if not isinstance(given, Mapping):
        example = dict(list(own.items())[:1])
        raise TypeError(f"parameters is {type(given).__name__}; give values by name, such as {example}")
    for name in given:
        if name not in own:
            raise ValueError(_unknown(name, own))
    tensors = {name: value for name, value in given.items() if _is_tensor(value)}
    seen = {name: _number(name, value) for name, value in given.items() if name not in tensors}
    plain = {**own, **seen}
    seen |= {name: _number(name, value) for name, value in _looked_at(tensors).items()}
    hidden = tensors.keys() - seen.keys()
    touched = [
        body
        for body in bodies
        if not seen.keys().isdisjoint(body.parameters) and hidden.isdisjoint(body.parameters)
    ]
    if touched:
        _check_bodies(touched, {**own, **seen}, seen)
    return {**plain, **tensors}


def _number(name: str, value: object) -> Value:
    """Return a value as a float or an array of floats.

    Raises TypeError for what is not a real number or an array of them, ValueError for NaN and infinity.
    """
    if type(value) is float and math.isfinite(value):
        return value
    try:
        array = np.asarray(value)
        real = array.dtype.kind in "fiu" or (
            array.dtype.kind == "O" and all(isinstance(x, Real) for x in array.flat)
        )
        array = array.astype(np.float64) if real else array
    except (TypeError, ValueError, OverflowError):  # lists of unequal lengths; numbers too large
        real = False
    if not real or isinstance(value, np.ma.MaskedArray):
        raise TypeError(
            f"parameter {short(name)} is {short(value)}; give a number, or an array of one for each sample"
        )
    if not np.isfinite(array).all():
        raise ValueError(f"parameter {short(name)} is NaN or infinite; give a finite number")
    return array if array.ndim else float(array)


def fits(name: str, shape: Sequence[int], batch: Sequence[int]) -> None:
    """Raise ValueError for a parameter that is neither one number nor one for each sample of the motion."""
    missing = len(batch) - len(shape)
    if missing < 0 or any(size not in (1, b) for size, b in zip(shape, batch[missing:], strict=True)):
        raise ValueError(
            f"parameter {short(name)} has shape {tuple(shape)}, the motion has samples of shape "
            f"{tuple(batch)}; give one number, or one for each sample"
        )


def faults(values: NDArray[np.float64]) -> NDArray[np.intp]:
    """Return an index into REASONS for each of bodies (..., 7), which are listed as by a `ParametricBody`."""
    mass, (xx, yy, zz, xy, xz, yz) = values[..., 0], np.moveaxis(values[..., 1:], -1, 0)
    broken: NDArray[np.bool_] = np.logical_not(np.isfinite(values).all(-1))
    tensor = np.stack([xx, xy, xz, xy, yy, yz, xz, yz, zz], -1)
    tensor = np.where(np.expand_dims(broken, -1), 0.0, tensor).reshape(*mass.shape, 3, 3)
    moments = np.linalg.eigvalsh(tensor)
    noise = np.maximum(SPECK * mass, np.finfo(float).eps * np.abs(moments).max(-1))
    moments = np.where(np.abs(moments) <= noise[..., None], 0.0, moments)
    low, middle, high = np.moveaxis(moments, -1, 0)
    triangle = high > low + middle + TRIANGLE * high
    negative = (low < -TRIANGLE * high) | (high < 0)
    return np.select([broken, mass < 0, negative, triangle], [1, 2, 3, 4], 0)


REASONS = (
    "",
    "a mass or an inertia that is NaN or infinite",
    "a negative mass",
    "an inertia that is not positive: a principal moment is negative",
    "an inertia that breaks the triangle inequality: a principal moment exceeds the sum of the others",
)


def _check_bodies(
    bodies: Sequence[ParametricBody], values: Mapping[str, Value], given: Mapping[str, Value]
) -> None:
    known = {name: np.float64(value) if type(value) is float else value for name, value in values.items()}
    with np.errstate(all="ignore"):  # numbers of NumPy divide by zero without raising
        rows = [body.mass_and_inertia(known) for body in bodies]
    flat = [entry for row in rows for entry in row]
    try:
        entries = np.array(np.broadcast_arrays(*flat) if any(map(np.ndim, flat)) else flat, dtype=float)
    except ValueError:
        raise ValueError(
            f"parameters {_listed(given, given)} differ in shape; give each one number a sample"
        ) from None
    found = faults(np.moveaxis(entries.reshape(len(bodies), 7, *entries.shape[1:]), 1, -1))
    for body, found_here in zip(bodies, found, strict=True):
        if found_here.any():
            names = [name for name in given if name in body.parameters]
            raise ValueError(
                f"link {short(body.link)} would have {REASONS[found_here.max()]}, "
                f"with {_listed(names, given)}; no body has that: correct it, or generate the package with "
                "--allow-unphysical"
            )


def _unknown(name: str, own: Mapping[str, float]) -> str:
    if not own:
        return (
            f"no parameter {short(name)}: this package has no parameters; generate it with "
            "--parameters symbolic"
        )
    known = choice(name, own, "parameters")
    listed = "" if len(own) > MOST_NAMES else "the parameters are "
    return f"no parameter {short(name)} in any number; {listed}{known}"


def _is_tensor(value: object) -> "TypeGuard[Tensor]":
    """Return whether a value is a torch tensor, without importing torch."""
    torch = sys.modules.get("torch")
    return torch is not None and isinstance(value, torch.Tensor)


def _looked_at(tensors: "Mapping[str, Tensor]") -> dict[str, object]:
    """Return the values that tensors have now, without gradients, in one transfer for each kind.

    Tensors inside torch.func and torch.compile, and those without data, cannot be looked at and are left out.
    """
    torch = sys.modules.get("torch")
    if (
        torch is None
        or not tensors
        or torch.compiler.is_compiling()
        or torch._C._are_functorch_transforms_active()
    ):
        return {}
    kinds: dict[tuple[object, ...], dict[str, Tensor]] = {}
    for name, tensor in tensors.items():
        if not tensor.is_meta:
            kinds.setdefault((tensor.device, tensor.dtype, tensor.shape), {})[name] = tensor.detach()
    values: dict[str, object] = {}
    for group in kinds.values():
        stacked = torch.stack(list(group.values())).cpu().resolve_conj()
        array = (stacked if stacked.is_complex() else stacked.double()).numpy()
        values |= zip(group, array if array.ndim > 1 else array.tolist(), strict=True)
    return values


def _listed(names: Collection[str], values: Mapping[str, Value]) -> str:
    """Return the first few parameters with their values, as text."""
    shown = [
        plain(name) if np.ndim(values[name]) else f"{plain(name)} = {values[name]:g}"
        for name in list(names)[:MOST_NAMES]
    ]
    more = f" and {len(names) - MOST_NAMES} more" if len(names) > MOST_NAMES else ""
    return f"{', '.join(shown)}{more}"
