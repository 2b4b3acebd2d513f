"""The optional libraries, imported when first needed."""

import importlib
from typing import Any

from linkwise.errors import LinkwiseError


def report_extra(module: str, extra: str = "report") -> Any:
    """Import a library of an extra; without it, say how to get it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        name = module.partition(".")[0]
        raise LinkwiseError(f"this report needs {name}: pip install linkwise[{extra}]") from error
