"""A walker of two legs in a plane, whose shanks touch the ground at points."""

from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from linkwise import generate, read_system, write_package
from linkwise.package.load import import_package

WALKER = """schema = 1
name = "walker"
gravity = [0, 0, -9.81]
joint = [
  { name = "x", type = "prismatic", parent = "base", child = "slide", axis = [1, 0, 0] },
  { name = "z", type = "prismatic", parent = "slide", child = "carriage", axis = [0, 0, 1] },
  { name = "pitch", parent = "carriage", child = "trunk", axis = [0, 1, 0] },
  { name = "hip_r", parent = "trunk", child = "thigh_r", xyz = [0, 0, -0.1], axis = [0, 1, 0] },
  { name = "knee_r", parent = "thigh_r", child = "shank_r", xyz = [0, 0, -0.4], axis = [0, 1, 0] },
  { name = "hip_l", parent = "trunk", child = "thigh_l", xyz = [0, 0.02, -0.1], axis = [0, 1, 0] },
  { name = "knee_l", parent = "thigh_l", child = "shank_l", xyz = [0, 0, -0.4], axis = [0, 1, 0] },
]
link = [
  { name = "slide" },
  { name = "carriage" },
  { name = "trunk", mass = 20, com = [0.02, 0, 0.2], inertia = { xx = 0.6, yy = 0.5, zz = 0.3 } },
  { name = "thigh_r", mass = 4, com = [0, 0, -0.2], inertia = { xx = 0.06, yy = 0.06, zz = 0.01 } },
  { name = "shank_r", mass = 2, com = [0.01, 0, -0.2], inertia = { xx = 0.03, yy = 0.03, zz = 0.005 } },
  { name = "thigh_l", mass = 4, com = [0, 0, -0.2], inertia = { xx = 0.06, yy = 0.06, zz = 0.01 } },
  { name = "shank_l", mass = 2, com = [0.01, 0, -0.2], inertia = { xx = 0.03, yy = 0.03, zz = 0.005 } },
]
"""
SOLE = (0.0, 0.0, -0.4)
"""Where a shank touches the ground."""
Q = np.array([0.1, 0.85, 0.05, 0.3, -0.5, -0.2, -0.3])
"""The walker with its feet apart."""


def walker_in(folder: Path) -> ModuleType:
    """Return its package."""
    (folder / "walker.toml").write_text(WALKER, encoding="utf-8")
    write_package(generate(read_system(folder / "walker.toml")), folder / "walker")
    return import_package(folder / "walker")


def feet(package: ModuleType, sides: str = "rl") -> list[Any]:
    return [package.Contact(f"shank_{side}", "point", SOLE, name=side) for side in sides]


def moving(ties: Any, q: Any, seed: int = 0) -> Any:
    shape = (*q.shape[:-1], len(ties.independent))
    return ties.velocity(q, np.random.default_rng(seed).uniform(-1.0, 1.0, shape))
