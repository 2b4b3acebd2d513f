"""The optional libraries, imported when first needed, and in this one place."""

import importlib
import os
from contextlib import suppress
from typing import Any

from linkwise.errors import LinkwiseError

BROUGHT_BY = {
    "clarabel": "identify",
    "ezc3d": "markers",
    "fsspec": "study",
    "h5py": "logs",
    "matplotlib": "motion",
    "mujoco": "mjcf",
    "networkx": "torch",
    "opensim": "opensim",
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

ONLY = {"opensim": ", which there is for Linux on x86-64 and Python up to 3.13"}
"""Where a library is to be had, if not everywhere."""
LEAST_ADDRESSES = {"numpy": 4 * 10**8, "pyarrow": 10**9, "torch": 10**9}
"""Least bytes of address space: with fewer, these may end the process in the midst of their work, and say
nothing of memory."""


def extra(module: str) -> Any:
    """Import a module of an optional library; raises LinkwiseError that says how to install it."""
    library = module.partition(".")[0]
    spare_addresses(library)
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise LinkwiseError(
            f"{library} is needed for this and is missing: pip install 'linkwise[{BROUGHT_BY[library]}]'"
            f"{ONLY.get(library, '')}"
        ) from error


def spare_addresses(library: str) -> None:
    """Make libraries reserve few addresses where these are bounded, as by `ulimit -v`.

    Arrow reserves a gigabyte otherwise, and OpenBLAS, when NumPy is imported, some for each thread. Raises
    LinkwiseError where they are too few for this library at all.
    """
    with suppress(ImportError):  # Windows, which has no such bound
        resource: Any = importlib.import_module("resource")
        bound, _ = resource.getrlimit(resource.RLIMIT_AS)
        if bound == resource.RLIM_INFINITY:
            return
        least = LEAST_ADDRESSES.get(library, 0)
        if bound < least:
            raise LinkwiseError(
                f"ulimit -v leaves {bound / 1e9:.2g} GB of addresses, too few for {library}; allow"
                f" {least / 1e9:g} GB, ulimit -v {least // 1000}"
            )
        os.environ.setdefault("ARROW_DEFAULT_MEMORY_POOL", "system")
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
