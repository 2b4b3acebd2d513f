"""The optional libraries of the `motion` extra, imported when first needed."""

import importlib
from typing import Any

from linkwise.errors import LinkwiseError


def extra(module: str) -> Any:
    """Import a library of the `motion` extra; without it, say how to get it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise LinkwiseError(
            f"motion analysis needs {module.partition('.')[0]}: pip install linkwise[motion]"
        ) from error
