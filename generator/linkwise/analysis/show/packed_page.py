"""Packed contents of pages that no reader sees: numbers, texts and plotly's script."""

import base64
import gzip

import numpy as np

from linkwise.extras import extra
from linkwise.package.load import Array


def plotly_parts() -> dict[str, str]:
    """Return plotly's script, packed, and its notice; it is most of a page: 4.8 MB, and packed 2.0 MB."""
    script = extra("plotly.offline").get_plotlyjs()
    notice = script[: script.find("*/")].replace("*", " ").strip("/ \n")
    return {"notice": " ".join(notice.split()), "plotly": packed(script)}


def packed(text: str) -> str:
    """Return a text as gzip in base64."""
    return base64.b64encode(gzip.compress(text.encode(), mtime=0)).decode("ascii")


def encoded(values: Array, kind: str = "<f8") -> str:
    """Return numbers as base64, float64 to the last bit unless another type is given."""
    return base64.b64encode(np.ascontiguousarray(values, kind).tobytes()).decode("ascii")
