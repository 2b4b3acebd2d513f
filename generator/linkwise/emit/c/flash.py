"""Bytes of flash that a package's C takes on a microcontroller, estimated from its text: no compiler runs.

Whoever chooses a microcontroller has its compiler last, and a manifest must not depend on one that is there.
They are of Thumb-2 as gcc makes it with -Os and LINKWISE_SMALL, for a processor whose floating-point unit has
the number type: code and constants of all functions, those of math.h apart. The weights fit what gcc 12 made
of robots of every kind; tests hold estimates to a fifth of that.
"""

import re
from collections.abc import Mapping

from linkwise.package.entries import CodeSize

COMMENT = re.compile(r"/\*.*?\*/", re.DOTALL)
COMMENT_OR_INDEX = re.compile(r"/\*.*?\*/|\[[^\]]*\]", re.DOTALL)
OPERATOR = re.compile(r" [-+*/] ")
WORD = re.compile(r" [-+*/] |x\.\w|p\[at")
NUMBER = re.compile(r"\bR\(")
SHORTS = re.compile(r"static const short \w+\[\] = \{([^}]*)\}")
"""Pattern of tables of the joints above each link, which grow with their number squared: 13 kB for 80 in a
row."""
LINK = re.compile(r"^void \w+_link_\d+\(", re.MULTILINE)

STRAIGHT, LOOPS, ENERGIES = (9_000, 8_300), (12_450, 10_900), (3_700, 3_700)
"""Bytes, in double and in float, that every robot has: of rigid links with closed forms, of those in loops,
and of energies."""

FREE_STRAIGHT, FREE_LOOPS = (8_400, 7_900), (7_250, 7_100)
"""Bytes of forward dynamics and controllers, for robots of rigid links whose joints nothing ties."""

OPERATION, SETTING, OWN = (6.6, 5.35), (18, 15), (140, 135)
"""Bytes per operation of closed forms, with what it loads and keeps; per word of the code that sets numbers
by its parameters; per link, with its tables and its function."""


def code_size(name: str, files: Mapping[str, str]) -> CodeSize | None:
    """Return the estimate in double and in float for a package's files; None for one without C."""
    if f"c/{name}.c" not in files:
        return None
    links_code = [text for path, text in files.items() if re.fullmatch(r"c/link_\d+\.h", path)]
    tree, header = COMMENT.sub("", files.get(f"c/{name}_tree.h", "")), files[f"c/{name}.h"]
    operations = sum(len(OPERATOR.findall(COMMENT_OR_INDEX.sub("", text))) for text in links_code)
    links = len(LINK.findall(header)) // 2  # of double and float
    settings, numbers = len(WORD.findall(tree)), len(NUMBER.findall(tree))
    tables = SHORTS.findall(tree) + SHORTS.findall(COMMENT.sub("", files[f"c/{name}.c"]))
    above = sum(len(table.split(",")) - 1 for table in tables)
    base = ENERGIES if not tree else STRAIGHT if links_code else LOOPS
    is_free = f" {name}_frame_partial_impedance(" in header
    free = (FREE_STRAIGHT if links_code else FREE_LOOPS) if is_free else (0, 0)
    double, single = (
        base[at]
        + free[at]
        + round(OPERATION[at] * operations)
        + SETTING[at] * settings
        + OWN[at] * links
        + 2 * above
        + numbers * real
        for at, real in enumerate((8, 4))
    )
    return CodeSize(double, single)
