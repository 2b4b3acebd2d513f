"""The module for Python that native_module.c is the text of: calls of C without a detour through Python.

It is there where Python's and NumPy's headers are; without it, ctypes calls the same functions.
"""

import sys
import sysconfig
from functools import cache
from importlib.machinery import ExtensionFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any

import numpy as np

from .native_build import extension

SOURCE = Path(__file__).with_suffix(".c")


def headers() -> tuple[str, ...]:
    """Folders of the headers; empty where one is missing, or this Python cannot take the module."""
    if sys.implementation.name != "cpython" or sysconfig.get_config_var("Py_GIL_DISABLED"):
        return ()
    paths = sysconfig.get_paths()
    python, numpy = dict.fromkeys((paths["include"], paths["platinclude"])), np.get_include()
    there = (Path(paths["include"], "Python.h"), Path(numpy, "numpy", "arrayobject.h"))
    return (*python, numpy) if all(file.is_file() for file in there) else ()


@cache
def compiled_calls() -> Any:
    """The class `Calls` of native_module.c, compiled if need be; None where it cannot be had."""
    found = headers()
    if not found:
        return None
    versions = (sys.implementation.cache_tag, np.__version__)
    try:
        path = str(extension(SOURCE, found, versions))
        loader = ExtensionFileLoader(SOURCE.stem, path)
        spec = spec_from_file_location(SOURCE.stem, path, loader=loader)
        assert spec is not None
        module = module_from_spec(spec)
        loader.exec_module(module)
    except (RuntimeError, ImportError, OSError):
        return None
    return module.Calls
