"""The library that some numbers belong to."""

import sys
from typing import Any

import numpy as np


def namespace(values: Any) -> Any:
    """NumPy for an array, torch for a tensor; it is there already, and not imported."""
    return np if isinstance(values, np.ndarray) else sys.modules["torch"]
