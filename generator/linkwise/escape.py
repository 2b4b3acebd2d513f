"""Escaping of text from a file for where it goes: one function for each kind of place, and no other escaping.

Names of robots, links, joints, parameters and columns are any text. Where code needs a name, it is made by
`identifiers`; everywhere else the text itself is shown, such that it can neither end the place where it
stands nor give orders to whatever reads that: a compiler, a browser, a terminal.
"""

import hashlib
import html
import json
import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any
from urllib.parse import quote

LONGEST_NAME = 60
"""Characters of a name that a comment, a list or a file's name shows."""
MARKUP = re.compile(r"(?<![0-9A-Za-z])_|_(?![0-9A-Za-z])|[\\`*\[\]|~$#^!:<>&]")
"""Characters that Markdown may take for markup; an underscore within a word is none."""
ENTITIES = {"<": "&lt;", ">": "&gt;", "&": "&amp;"}
ENDING = re.compile(r"[_-](joint|link)$", re.IGNORECASE)
"""Common endings of the names of joints and links."""
GREEK = re.compile(
    "alpha|beta|gamma|delta|epsilon|zeta|eta|theta|iota|kappa|lambda|mu|nu|xi|pi|rho|sigma|tau|upsilon|phi|chi"
    "|psi|omega|Gamma|Delta|Theta|Lambda|Xi|Pi|Sigma|Upsilon|Phi|Psi|Omega"
)
"""Names of letters that LaTeX has."""


def printable(text: str, shows: Callable[[str], bool] = str.isprintable) -> str:
    r"""Return plain text on one line: the unseen, or what turns what follows, as \n, \x1b or \u202e.

    `shows` says of a character whether it can be shown as it is.
    """
    return text if all(map(shows, text)) else "".join(c if shows(c) else _escape(c) for c in text)


def one_line(text: str, most: int) -> str:
    """Return a message as one printable line of at most `most` characters, its middle left out if longer."""
    return short(printable(re.sub(r"\s*[\r\n]\s*", " ", text.strip())), most)


def short(text: str, most: int = 24) -> str:
    """Return the text, its middle left out if longer than `most`: exporters number names at their end."""
    if len(text) <= most:
        return text
    tail = (most - 1) // 2
    return f"{text[: most - 1 - tail]}…{text[-tail:]}"


def without_ending(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names without the ending "_joint", or "_link", if all have it.

    Otherwise they stay as they are, also where one would be empty or another's without it.
    """
    bare = tuple(ENDING.sub("", name) for name in names)
    cut = all(map(ENDING.search, names)) and all(bare) and len(set(bare)) == len(bare)
    return bare if cut else tuple(names)


def listed(items: Iterable[object], most: int = 8, longest: int = LONGEST_NAME) -> str:
    """Return a list for a message: "a, b, c and 212 more", items beyond `longest` shortened."""
    texts = [short(str(item), longest) for item in items]
    more = f" and {len(texts) - most} more" if len(texts) > most else ""
    return f"{', '.join(texts[:most])}{more}"


def markdown(text: str) -> str:
    """Return text for a phrase or table cell of Markdown, in dialects with tables, formulas or emoji too."""
    return MARKUP.sub(lambda found: ENTITIES.get(found[0], f"\\{found[0]}"), printable(text))


def html_text(text: str) -> str:
    """Return text, or a quoted attribute, for HTML."""
    return html.escape(printable(text))


def script_data(data: Any) -> str:
    """Return JSON as the content of an HTML `script` element, which nothing in it can end.

    Raises ValueError for NaN.
    """
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return re.sub("[<>&]", lambda found: _unicode(found[0]), text)


def json_text(data: Any, indent: int | None = None) -> str:
    """Return JSON to read, in a file or on a terminal: letters as they are, the unprintable as escapes.

    Raises ValueError for NaN and infinity, which JSON does not have.
    """
    text = json.dumps(data, indent=indent, ensure_ascii=False, allow_nan=False)
    if all(map(str.isprintable, text.split("\n"))):  # nearly always, and many times quicker
        return text
    # Outside of strings JSON holds no other such character than the line ends that `indent` makes.
    return "".join(c if c.isprintable() or c == "\n" else _unicode(c) for c in text)


def python_literal(text: str) -> str:
    """Return a string literal of Python in ASCII; in quotes, it also names something in plain text."""
    return ascii(text)


def python_docstring(text: str) -> str:
    """Return a quoted name for a docstring, which no quote or backslash in it can end."""
    return re.sub(r'[\\"]', r"\\\g<0>", ascii(text))


def c_comment(text: str) -> str:
    """Return a quoted name for a comment of C: in ASCII, no comment's start or end nor trigraph in it."""
    literal = ascii(text)
    literal = literal if len(literal) <= LONGEST_NAME else f"{literal[:LONGEST_NAME]}..."
    return re.sub(r"\*(?=/)|/(?=\*)|\?(?=\?)", r"\g<0> ", literal)


def c_string(text: str) -> str:
    """Return a string literal of C in ASCII, whose bytes are the name in UTF-8.

    There is neither a trigraph nor a comment in it.
    """
    plain = "".join(chr(b) if 32 <= b < 127 and chr(b) not in '"\\?' else f"\\{b:03o}" for b in text.encode())
    return '"{}"'.format(plain.replace("/*", "\\057*").replace("*/", "*\\057"))


def latex_symbol(identifier: str) -> str:
    """Return an identifier in LaTeX: its first letters, and the rest as their index, literally."""
    head = re.match("[A-Za-z]*", identifier)[0]  # type: ignore[index]
    index = identifier[len(head) :].removeprefix("_")
    upright = f"\\{head}" if GREEK.fullmatch(head) else head if len(head) == 1 else f"\\mathrm{{{head}}}"
    below = index if index.isdigit() else "\\mathrm{{{}}}".format(index.replace("_", "\\_"))
    return f"{upright}_{{{below}}}" if index else upright


def identifiers(names: Sequence[str], prefix: str, taken: Iterable[str] = ()) -> list[str]:
    """Return distinct names for code, of Python and of C alike: ASCII letters, digits and _ after a prefix.

    Compilers need not tell more than 63 characters apart.
    """
    used = set(taken)
    made = []
    for name in names:
        safe = (prefix + re.sub(r"[^0-9A-Za-z]", "_", name))[:LONGEST_NAME]
        number, found = 1, safe
        while found in used:
            number += 1
            found = f"{safe}_{number}"
        used.add(found)
        made.append(found)
    return made


def column_part(text: str) -> str:
    """Return a part, between slashes, of a table's column name: printable, different for different texts."""
    if text.isprintable() and "%" not in text and "/" not in text:
        return text
    return "".join(c if c.isprintable() and c not in "%/" else _percent(c) for c in text)


def file_name(text: str) -> str:
    """Return a part of a file's name in ASCII, different for different texts, short, without separators."""
    safe = _percent(text)
    if len(safe) <= LONGEST_NAME:
        return safe
    return f"{safe[:LONGEST_NAME]}-{hashlib.sha256(safe.encode()).hexdigest()[:8]}"


def file_names(names: Iterable[str]) -> list[str]:
    """Return the names, numbered where two would be one on a file system that takes A for a."""
    used: set[str] = set()
    made = []
    for name in names:
        number, found = 1, name
        while found.lower() in used:
            number += 1
            found = f"{name}-{number}"
        used.add(found.lower())
        made.append(found)
    return made


def _escape(character: str) -> str:
    """Return a character as Python writes it in a string."""
    return character.encode("unicode_escape").decode("ascii")


def _percent(text: str) -> str:
    """Return a text as an address on the web writes it."""
    return quote(text, safe="", errors="surrogatepass")


def _unicode(character: str) -> str:
    """Return a character as JSON and JavaScript write it in a string."""
    return json.dumps(character)[1:-1] if not character.isascii() else f"\\u{ord(character):04x}"
