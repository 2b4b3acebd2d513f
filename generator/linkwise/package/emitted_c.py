"""Check of the C of a package, read as text before it is compiled.

Beside numbers that a file declares itself, it may have the words of linkwise's own C, and call what that
calls. Macros could give words another meaning, and files another text than what is read here: so each
directive must be one of those that linkwise writes, and what a compiler would join or replace before it reads
is refused.
"""

import re
from collections.abc import Iterator
from functools import cache, lru_cache
from importlib.resources import files
from typing import NamedTuple

ORDINARY = "arithmetic, sines and the like, and names"
FUNCTIONS = frozenset(
    (
        "sin",
        "cos",
        "tan",
        "asin",
        "acos",
        "atan",
        "sinh",
        "cosh",
        "tanh",
        "exp",
        "log",
        "sqrt",
        "abs",
        "atan2",
        "pow",
    )
)
"""Functions of closed forms; C has fabs in place of abs."""
SPLICED = re.compile(r"\?\?|\\[ \t\f\v\r]*\n|\r(?!\n)|[^\t\n\r -~]")
"""Pattern of trigraphs, of lines that go on or end otherwise, which compilers read as another text than this,
and of what is not ASCII."""
DIGRAPH = re.compile(r"<:|:>|<%|%>|%:")
QUOTED = re.compile(
    r"""(?P<comment>/\*.*?\*/|//[^\n]*)|(?P<string>"(?:[^"\\\n]|\\.)*")|(?P<quote>["'])""", re.DOTALL
)
TOKEN = re.compile(
    r"""(?P<directive>^[ \t]*\#[^\n]*)|(?P<word>[A-Za-z_]\w*)|(?P<number>\.?\d(?:[eEpP][-+]|[\w.])*)
    |(?P<called>[])][ \t\n]*\()""",
    re.MULTILINE | re.VERBOSE,
)
DECLARED = re.compile(r"\b(?:real|int|short|char|size_t|double|float)\s+\**\s*(?:RESTRICT\s+)?(\w+)")
ENUMERATED = re.compile(r"\benum\s*\{([^{}]*)\}")
MADE = re.compile(r"\b(LINK_FUNCTION|API|F|SIZED)\((\w+)$")
"""Pattern, up to the bracket that ends it, of a name that a macro makes, which may be called."""
OF_LINK = re.compile(r"links?_\d+(?:_\w+)?|at_p_\w+")
INCLUDE = re.compile(r'^[ \t]*#[ \t]*include\b[ \t]*([<"]?)([^>"\n]*)[>"]?', re.MULTILINE)
HEADERS = frozenset(("float.h", "math.h", "stddef.h"))
ARGUMENTS = "INPUTS|PASSED|PASSED_ROW|AT_REST|PASSED_AT_REST|RESULTS|RESULTS_ROW|AT_POSITION|UNDER_TORQUE"
MARKS = r"LINKWISE_\w+|WANT_\w+|CURVED|PASSIVE|TIED"
STRUCTURES = "|".join(
    rf"{macro}\({x}\) const struct {what} (?:{made} = {what}_of\(p\), )?\*const {x} = &(?:{made}|own_{what})"
    for macro, x, what, made in (("NUMBERS", "x", "numbers", "of_p"), ("OFFSETS", "o", "offsets", "o_of_p"))
)
DIRECTIVE = re.compile(
    r"# *(?:include\b.*|else|endif|(?:if|ifdef|ifndef|elif)\b[^#]*"
    rf"|undef (?:{ARGUMENTS}|{MARKS}|W|SIZED|LINK_FUNCTION|NUMBERS|OFFSETS|API)"
    rf"|define (?:(?:{MARKS})|W (?:1|BLOCK)|(?:{ARGUMENTS}) [\w ,*+]*|{STRUCTURES}"
    r"|SIZED\(name\) name##_(?:one|block)|LINK_FUNCTION\(name\) (?:static|APART) void SIZED\(name\)"
    r"|API\(function\) F\((?P<robot>\w+)_##function\)))"
)
"""Pattern of each directive in the templates of C, with what is put into them."""
JINJA = re.compile(r"\{[{%#].*?[}%#]\}", re.DOTALL)
TAKEN = frozenset(("asm", "goto"))


def foreign_includes(text: str, folder: str, listed: frozenset[str]) -> Iterator[str]:
    """Yield what a C file in a folder of a package includes beside listed files and standard headers."""
    for found in INCLUDE.finditer(_blanked(text, "comment")[0]):
        quote, file = found[1], found[2].strip()
        own = file.endswith((".h", ".c")) and f"{folder}/{file}" in listed
        if not (file in HEADERS if quote == "<" else quote == '"' and own):
            yield f"line {_line(text, found.start())} has {' '.join(found[0].split())}, which is not listed"


def foreign_c(text: str, name: str) -> Iterator[str]:
    """Yield what a C file of a package says beside the vocabulary of linkwise's own C and local numbers.

    Words that neither that nor the robot's name has must be numbers declared in the file, and never called.
    """
    for place, told in _read(text, name):
        yield f"line {_line(text, place)} {told}, where linkwise writes {ORDINARY} alone"


def _read(text: str, name: str) -> Iterator[tuple[int, str]]:
    if found := SPLICED.search(text):
        yield found.start(), f"has {found[0]!a}"
    code, wrong = _blanked(text, "comment", "string")
    yield from wrong
    if found := DIGRAPH.search(code):
        yield found.start(), f"has {found[0]}"
    enumerated = (re.findall(r"([A-Za-z_]\w*)\s*=", names) for names in ENUMERATED.findall(code))
    local = frozenset(DECLARED.findall(code)).union(*enumerated)
    for token in TOKEN.finditer(code):
        what, told = token[0], ""
        match token.lastgroup:
            case "word":
                called = re.match(r"\s*\(", code[token.end() : token.end() + 80]) is not None
                told = _word(what, called, local, name)
            case "directive":
                told = _directive(" ".join(what.split()), local, name)
            case "called":
                made = MADE.search(code[: token.start()][-80:])
                told = "" if made and _is_made(made[1], made[2]) else "calls what an expression gives"
        if told:
            yield token.start(), told


def _blanked(text: str, *kinds: str) -> tuple[str, list[tuple[int, str]]]:
    """Return the text with blanks for comments, and for strings if asked; and the strings that do not end."""
    wrong: list[tuple[int, str]] = []

    def blank(found: re.Match[str]) -> str:
        if found.lastgroup == "quote":
            wrong.append((found.start(), "has a string that does not end"))
        return re.sub(r"[^\n]", " ", found[0]) if found.lastgroup in kinds else found[0]

    return QUOTED.sub(blank, text), wrong


def _directive(line: str, local: frozenset[str], name: str) -> str:
    """Return what is wrong with a preprocessor line; what it includes is checked separately."""
    found = DIRECTIVE.fullmatch(line)
    if found is None or found["robot"] not in (None, name):
        return f"has {line}"
    words = [] if "include" in line else re.findall(r"[A-Za-z_]\w*", line)[1:]
    return next(filter(None, (_word(word, False, local, name) for word in words)), "")


@lru_cache(maxsize=4096)
def _word(what: str, called: bool, local: frozenset[str], name: str) -> str:
    """Return what is wrong with a word; empty if nothing."""
    known = _vocabulary()
    if OF_LINK.fullmatch(what):
        return ""
    if what in TAKEN or (what.startswith("__") and what not in known.inner):
        return f"names {what}"
    for robot in (name, name.upper(), f"LINKWISE_{name.upper()}"):
        if what.startswith(f"{robot}_") and (not called or _is_of_robot(what[len(robot) + 1 :])):
            return ""
    if what not in known.words and (called or what not in local):
        return f"names {what}"
    return f"calls {what}" if called and what not in known.calls else ""


def _is_of_robot(ending: str) -> bool:
    """Return whether linkwise has a function whose name is the robot's name with this ending."""
    ends, calls = (ending, ending.removesuffix("f")), _vocabulary().calls
    return any(f"_{end}" in calls or OF_LINK.fullmatch(end) for end in ends)


def _is_made(macro: str, word: str) -> bool:
    """Return whether a macro makes a name of linkwise's own C from this word."""
    if macro == "F":  # single precision appends an f
        return word in FUNCTIONS | {"fabs"}
    return macro != "API" or word in _vocabulary().made or OF_LINK.fullmatch(word) is not None


def _line(text: str, place: int) -> int:
    return text[:place].count("\n") + 1


class Vocabulary(NamedTuple):
    """Words of linkwise's own C: all, those before a bracket, those in API(...), those of its templates."""

    words: frozenset[str]
    calls: frozenset[str]
    made: frozenset[str]
    inner: frozenset[str]


@cache
def _vocabulary() -> Vocabulary:
    plain = []
    for folder in (files(place).joinpath("c") for place in ("linkwise", "linkwise.templates")):
        own = (file for file in folder.iterdir() if file.name.endswith((".h", ".j2")))
        text = JINJA.sub(" ", "\n".join(file.read_text(encoding="utf-8") for file in own))
        plain.append(re.sub(r"/\*.*?\*/|//[^\n]*", " ", text, flags=re.DOTALL))
    all_words, inner = (re.findall(r"[A-Za-z_]\w*", text) for text in ("\n".join(plain), plain[1]))
    before, made = (
        frozenset(re.findall(pattern, "\n".join(plain)))
        for pattern in (r"([A-Za-z_]\w*)\s*\(", r"\bAPI\((\w+)\)")
    )
    return Vocabulary(frozenset(all_words) | FUNCTIONS | {"fabs", "HUGE_VAL"}, before, made, frozenset(inner))
