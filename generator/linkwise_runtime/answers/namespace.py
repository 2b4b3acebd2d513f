"""Library that numbers belong to, their precision, and how they lie in memory."""

import sys
from collections.abc import Mapping
from typing import TYPE_CHECKING, cast

import numpy as np
from numpy.typing import NDArray

from ..interface import Namespace, Numbers

if TYPE_CHECKING:
    from torch import Tensor  # type: ignore[import-not-found, unused-ignore]

NUMPY = cast(Namespace, np)
MODULES = cast(Mapping[str, Namespace], sys.modules)
"""Modules that are imported already: wherever there is a tensor, torch is."""


def namespace(values: object) -> Namespace:
    """Return NumPy for an array, torch for a tensor; torch is imported already then."""
    return NUMPY if isinstance(values, np.ndarray) else MODULES["torch"]


def is_traced(values: Numbers) -> bool:
    """Return whether the numbers cannot be looked at.

    That is so where a compiler or a transformation such as vmap follows them, and where they have no data.
    """
    if isinstance(values, np.ndarray):
        return False
    torch = sys.modules["torch"]
    return bool(
        torch.compiler.is_compiling()
        or torch._C._are_functorch_transforms_active()
        or cast("Tensor", values).is_meta
    )


def side_by_side(values: Numbers) -> Numbers:
    """Return the numbers in C's order, without gaps in memory."""
    if isinstance(values, np.ndarray):
        return np.ascontiguousarray(values)
    return cast("Tensor", values).contiguous()


def array_of(values: Numbers) -> NDArray[np.floating]:
    """Return an array as it is, or the numbers of a tensor as an array."""
    if isinstance(values, np.ndarray):
        return values
    return np.asarray(values.detach().cpu() if hasattr(values, "detach") else values)


def kind_of(values: Numbers) -> np.dtype[np.floating]:
    """Return NumPy's dtype of floats for an array or a tensor."""
    return np.dtype(np.float64 if values.dtype.itemsize == 8 else np.float32)


def epsilon_of(values: Numbers) -> float:
    """Return the relative rounding of the dtype of an array or a tensor."""
    return float(np.finfo(kind_of(values)).eps)
