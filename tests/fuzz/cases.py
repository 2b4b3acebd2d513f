"""Every kind of broken input, and the case of a seed."""

from collections.abc import Callable
from random import Random

from fuzz.broken_commands import manifest, options
from fuzz.broken_logs import csv, parquet, storage
from fuzz.broken_recordings import arrays, bag
from fuzz.broken_robots import energies, mjcf, toml, urdf
from fuzz.case import Case

MAKERS = (toml, urdf, mjcf, energies, csv, storage, parquet, bag, arrays, manifest, options)
KINDS: dict[str, Callable[[Random], Case]] = {make.__name__: make for make in MAKERS}
WEIGHTS = {"toml": 4, "urdf": 4, "csv": 4, "storage": 3} | dict.fromkeys(
    ("mjcf", "parquet", "bag", "arrays", "manifest", "options"), 2
)
"""Cases of a kind in a round; 1 where it is not here."""


def case_of(kind: str, seed: int) -> Case:
    """The case of a seed."""
    return KINDS[kind](Random(f"{kind} {seed}"))
