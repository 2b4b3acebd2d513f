"""Folders where programs that tests start look for modules."""

import os
from pathlib import Path


def before(folder: Path) -> str:
    """PYTHONPATH with this folder before what it has."""
    return os.pathsep.join([str(folder), *filter(None, [os.environ.get("PYTHONPATH")])])
