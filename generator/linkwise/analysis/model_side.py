"""Lists and values of a model by part of its torques: acceleration, velocity, gravity, and the whole."""

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[np.intp]


@dataclass(frozen=True, eq=False)
class Side:
    """Parts that `Layout` lists and that packed values hold, by the same names."""

    acceleration: Any
    velocity: Any
    gravity: Any
    torque: Any


NAMES = tuple(field.name for field in fields(Side))
