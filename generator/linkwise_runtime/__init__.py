"""Runtime that generated packages import: a robot's structure, its calls and the back ends that compute them.

It needs NumPy, and torch for the back ends that compute with tensors; whatever differs from robot to robot is
passed in as arguments.
"""

import sys

if not getattr(sys, "_is_gil_enabled", lambda: True)():
    raise ImportError(
        "linkwise has never been tried in a Python without its global lock; start it with PYTHON_GIL=1 in the"
        " environment, or with -X gil=1"
    )
