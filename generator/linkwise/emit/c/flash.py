"""Bytes of flash that a package's C takes on a microcontroller, reckoned from its text: no compiler runs.

They are of Thumb-2 as gcc makes it with -Os and LINKWISE_SMALL, for a processor with a floating-point unit for
the number type: code and constants of all functions, those of math.h apart. The weights fit what gcc 12 made
of robots of every kind; tests hold estimates to a fifth of that.
"""

import re
from collections.abc import Mapping

from linkwise.package.entries import CodeSize

COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
OPERATION = re.compile(r" [-+*/] ")
NUMBER = re.compile(r"\bR\(")
LINK = re.compile(r"^void \w+_link_\d+\(", re.MULTILINE)

RIGID, IMPEDANCE, ENERGIES, LOOPS = (15_900, 13_700), (2_000, 2_000), (3_000, 3_000), (2_200, 2_200)
"""Bytes of what every robot of rigid links has, in double and in float; of controllers; of links of energies
in place of both; and of a kernel in loops."""

OPERATIONS, OPERATION_OF_PARAMETERS, OWN_LINK = (6.6, 5.2), (12.0, 12.0), (90.0, 80.0)
"""Of an operation of closed forms, with what it loads and keeps; of one that sets the robot's numbers from
its parameters; of the function of one link."""


def code_size(name: str, files: Mapping[str, str]) -> CodeSize | None:
    """Return the estimate in double and in float for a package's files; None for one without C."""
    if f"c/{name}.c" not in files:
        return None
    kernels = [text for path, text in files.items() if re.fullmatch(r"c/link_\d+\.h", path)]
    tree = COMMENT.sub("", files.get(f"c/{name}_tree.h", ""))
    operations = sum(len(OPERATION.findall(COMMENT.sub("", text))) for text in kernels)
    links = len(LINK.findall(files[f"c/{name}.h"])) // 2  # of double and float
    double, single = (
        _reals(tree) * real
        + (RIGID if tree else ENERGIES)[at]
        + IMPEDANCE[at] * (bool(tree) and "frame_partial_impedance" in files[f"c/{name}.h"])
        + LOOPS[at] * (not kernels)
        + round(OPERATIONS[at] * operations)
        + round(OPERATION_OF_PARAMETERS[at] * len(OPERATION.findall(tree)))
        + round(OWN_LINK[at] * links)
        for at, real in enumerate((8, 4))
    )
    return CodeSize(double, single)


def _reals(tree: str) -> int:
    """Numbers in the robot's tables."""
    return len(NUMBER.findall(tree))
