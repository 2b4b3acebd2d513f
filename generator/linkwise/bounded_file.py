"""Bounds on files, checked before these are parsed: parsers take time and memory far beyond their size."""

import re
import tomllib
from pathlib import Path
from typing import Any

from linkwise.errors import LinkwiseError

MIB = 2**20
MAX_DEPTH = 16
"""Deepest nesting of brackets, and most parts of a key; schema 1 has three."""

# A string without an end counts to the end of its line or of the text: trying again from each of its quotes
# would take quadratic time. A string of several lines may be closed by two quotes more than open it.
STRINGS_AND_COMMENTS = re.compile(
    r'"""(?:\\.|[^\\])*?(?:"{3,5}|\Z)'
    r"|'''.*?(?:'{3,5}|\Z)"
    r'|"(?:\\.|[^"\\\n])*"?'
    r"|'[^'\n]*'?"
    r"|#[^\n]*",
    re.DOTALL,
)
ENDLESS = re.compile(r"0[box]([0-9A-Fa-f_]{501,})|([0-9_]{601,})")
"""Digits of a number that Python may refuse to read, or to write, as an integer; the largest has 309."""
NOT_OF_A_KEY = re.compile(r"[^\w.\- \t]+")


def content(path: Path, most: int) -> bytes:
    """Return the bytes of a file; raises LinkwiseError for one of more than `most` bytes."""
    with path.open("rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise too_large(most)
    return data


def too_large(most: int) -> LinkwiseError:
    """Return the error for a robot's file of more than `most` bytes."""
    return LinkwiseError(
        f"the file is larger than {most // MIB} MiB, which no robot's description is; "
        "give one without meshes and data in it"
    )


def check_toml_bounds(text: str) -> None:
    """Raise LinkwiseError for numbers longer, or brackets or keys deeper, than any robot's file has them.

    tomllib takes quadratic time for a key's dots: 15 s for 32,000. The check is linear. It works on the text
    without its strings and comments: brackets are then those of tables and arrays, and dots with nothing but
    words between them belong to one key.
    """
    structure = STRINGS_AND_COMMENTS.sub(lambda found: "s" + "\n" * found[0].count("\n"), text)
    if number := ENDLESS.search(structure):
        line, digits = (
            1 + structure.count("\n", 0, number.start()),
            len(number[number.lastindex or 0].replace("_", "")),
        )
        raise LinkwiseError(f"line {line} has a number of {digits} digits; 1e308 is about the largest")
    depth = deepest = 0
    for bracket in re.findall(r"[\[\]{}]", structure):
        depth = depth + 1 if bracket in "[{" else max(depth - 1, 0)
        deepest = max(deepest, depth)
    parts = 1 + max(key.count(".") for key in NOT_OF_A_KEY.split(structure))
    for what, found in (("brackets", deepest), ("a dotted key", parts)):
        if found > MAX_DEPTH:
            raise LinkwiseError(
                f"malformed TOML: {what} {found} deep; no robot's file needs more than {MAX_DEPTH}"
            )


LARGEST = MIB
"""Largest size of a file, in bytes."""


def toml_data(path: Path, most: int = LARGEST) -> dict[str, Any]:
    """Return the data of a file; raises LinkwiseError for what is not TOML or not of schema 1.

    most: size in bytes above which it is refused
    """
    try:
        text = content(path, most).decode("utf-8-sig").replace("\r\n", "\n")
        check_toml_bounds(text)
        data = tomllib.loads(text)
    except LinkwiseError:
        raise
    except (ValueError, RecursionError) as error:  # ValueError: not TOML, not UTF-8
        raise LinkwiseError(f"malformed TOML: {error}") from None
    if type(data.get("schema")) is not int or data["schema"] != 1:
        raise LinkwiseError(f"the schema is {data.get('schema')!r}; write schema = 1 at the top")
    return data
