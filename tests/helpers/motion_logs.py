"""Small logs and robots for the tests of motion analysis."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

ROOT = Path(__file__).parents[2]
PLANAR3 = ROOT / "generated" / "planar3"
PUMA560 = ROOT / "generated" / "puma560"
LEG = ROOT / "tests" / "data" / "leg.toml"
JOINTS = ("joint1", "joint2", "joint3")


def smooth(samples: int, joints: int, rate: float = 100.0) -> NDArray[np.float64]:
    """Time and joints (S, 1 + joints): sines of unlike frequencies."""
    time = np.arange(samples) / rate
    at = np.arange(joints)
    return np.column_stack([time, (0.5 + 0.2 * at) * np.sin((2 + 1.3 * at) * time[:, None] + at)])


def write_csv(path: Path, table: NDArray[np.float64], names: Sequence[str] = JOINTS) -> Path:
    """Write a table as CSV that reads back exactly."""
    rows = [",".join(["time", *names])] + [",".join(map(repr, row)) for row in table.tolist()]
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    return path


def write_mot(path: Path, table: NDArray[np.float64], names: Sequence[str], **header: str) -> Path:
    """Write a table as OpenSim storage: facts, `endheader`, names by tabs, values padded with blanks."""
    facts = {"nRows": str(len(table)), "nColumns": str(1 + len(names)), "inDegrees": "yes"} | header
    lines = ["Coordinates", "version=1", *(f"{key}={value}" for key, value in facts.items())]
    lines += ["", "Units are S.I. units", "", "endheader", "\t".join(["time", *names])]
    lines += ["\t".join(f"{value:16.8f}" for value in row) for row in table]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path
