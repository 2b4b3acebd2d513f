"""The library that some numbers belong to, their precision, and how they lie in memory."""

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
"""What is imported already: whoever has a tensor has torch."""


def namespace(values: object) -> Namespace:
    """NumPy for an array, torch for a tensor; it is there already, and not imported."""
    return NUMPY if isinstance(values, np.ndarray) else MODULES["torch"]


def hidden(values: Numbers) -> bool:
    """Whether nobody may look at the numbers: a compiler or a transformation such as vmap follows them."""
    if isinstance(values, np.ndarray):
        return False
    torch = sys.modules["torch"]
    return bool(
        torch.compiler.is_compiling()
        or torch._C._are_functorch_transforms_active()
        or cast("Tensor", values).is_meta
    )


def side_by_side(values: Numbers) -> Numbers:
    """The numbers in C's order, without gaps."""
    if isinstance(values, np.ndarray):
        return np.ascontiguousarray(values)
    return cast("Tensor", values).contiguous()


def array_of(values: Numbers) -> NDArray[np.floating]:
    """An array, or what a tensor holds."""
    if isinstance(values, np.ndarray):
        return values
    return np.asarray(values.detach().cpu() if hasattr(values, "detach") else values)


def kind_of(values: Numbers) -> np.dtype[np.floating]:
    """The dtype of floats, of an array or a tensor."""
    return np.dtype(np.float64 if values.dtype.itemsize == 8 else np.float32)


def epsilon_of(values: Numbers) -> float:
    """The rounding of its dtype."""
    return float(np.finfo(kind_of(values)).eps)
