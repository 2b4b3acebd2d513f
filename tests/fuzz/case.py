"""A command line and the files that it finds."""

from dataclasses import dataclass, field

NUMPY = ("--backend", "numpy")
JOINTS = ("joint1", "joint2", "joint3")
"""Joints of planar3."""


@dataclass(frozen=True)
class Case:
    """Arguments of `linkwise`, and the files there are; `{in}`, `{out}` and `{robot}` stand for folders.

    copied: whether a copy of the generated robot is at `{in}/package`, which `files` then change
    """

    arguments: tuple[str, ...]
    files: dict[str, bytes] = field(default_factory=dict)
    copied: bool = False
