"""The optional libraries, imported when first needed, and in this one place."""

import importlib
import os
from contextlib import suppress
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

LEAST_ADDRESSES = 10**9
"""Bytes; with fewer, Arrow ends the process in the midst of its import, and says nothing of memory."""


def extra(module: str) -> Any:
    """Import a module of an optional library; raises LinkwiseError that says how to install it."""
    library = module.partition(".")[0]
    if library == "pyarrow":
        _spare_addresses()
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise LinkwiseError(
            f"{library} is needed for this and is missing: pip install 'linkwise[{BROUGHT_BY[library]}]'"
        ) from error


def _spare_addresses() -> None:
    """Have Arrow not reserve a gigabyte of addresses where these are bounded, as by `ulimit -v`.

    Raises LinkwiseError where they are too few for it at all.
    """
    with suppress(ImportError):  # Windows, which has no such bound
        resource: Any = importlib.import_module("resource")
        bound, _ = resource.getrlimit(resource.RLIMIT_AS)
        if bound == resource.RLIM_INFINITY:
            return
        if bound < LEAST_ADDRESSES:
            raise LinkwiseError(
                f"ulimit -v leaves {bound / 1e9:.2g} GB of addresses, too few for pyarrow; allow a gigabyte,"
                f" ulimit -v {LEAST_ADDRESSES // 1000}"
            )
        os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")
