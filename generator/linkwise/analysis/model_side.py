"""What a model lists and computes by the parts of its torques."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Side:
    """What `Layout` lists and packed values hold, by the same names."""

    acceleration: Any
    velocity: Any
    gravity: Any
    torque: Any


NAMES = tuple(field.name for field in fields(Side))
