"""Releases of linkwise: README.md says how one is made, and `python -m release` does all but the upload."""

import sys
from pathlib import Path

sys.path.insert(
    0, str(Path(__file__).parents[1] / "generator")
)  # this checkout's, before one that is installed
