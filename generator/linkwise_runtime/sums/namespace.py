"""The library that some numbers belong to, and how they lie in memory."""

import sys
from typing import Any

import numpy as np


def namespace(values: Any) -> Any:
    """NumPy for an array, torch for a tensor; it is there already, and not imported."""
    return np if isinstance(values, np.ndarray) else sys.modules["torch"]


def hidden(values: Any) -> bool:
    """Whether nobody may look at the numbers: a compiler or a transformation such as vmap follows them."""
    if isinstance(values, np.ndarray):
        return False
    torch: Any = sys.modules["torch"]
    return bool(
        torch.compiler.is_compiling() or torch._C._are_functorch_transforms_active() or values.is_meta
    )


def side_by_side(values: Any) -> Any:
    """The numbers in C's order, without gaps."""
    return np.ascontiguousarray(values) if isinstance(values, np.ndarray) else values.contiguous()
