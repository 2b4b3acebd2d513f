"""Types of arrays of NumPy, in double precision unless said otherwise."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Index = NDArray[np.intp]
"""Numbers of rows, columns or entries."""
Mask = NDArray[np.bool_]
