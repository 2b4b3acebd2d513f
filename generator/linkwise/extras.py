"""The optional libraries, imported when first needed, and in this one place."""

import importlib
from typing import Any

from linkwise.errors import LinkwiseError

BROUGHT_BY = {
    "clarabel": "identify",
    "fsspec": "study",
    "h5py": "logs",
    "matplotlib": "motion",
    "mujoco": "mjcf",
    "networkx": "torch",
    "plotly": "motion",
    "pyarrow": "motion",
    "ray": "ray",
    "rosbags": "logs",
    "scipy": "motion",
    "spm1d": "spm",
    "tomlkit": "identify",
    "torch": "torch",
    "xarray": "names",
}
"""The extra of pyproject.toml that installs each library."""


def extra(module: str) -> Any:
    """Import a module of an optional library; raises LinkwiseError that says how to install it."""
    library = module.partition(".")[0]
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise LinkwiseError(
            f"{library} is needed for this and is missing: pip install 'linkwise[{BROUGHT_BY[library]}]'"
        ) from error
