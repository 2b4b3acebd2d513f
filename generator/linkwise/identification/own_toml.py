"""A robot in TOML with other inertias and friction: numbers, also in place of formulas."""

import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from linkwise.arrays import Array
from linkwise.bounded_file import toml_data
from linkwise.escape import listed
from linkwise.extras import extra
from linkwise.identification.own_file import Friction, LinkMass, NotWrittenBack, OwnFile
from linkwise.robot.readers.toml.reader import INERTIA

KEYS = ("mass", "com", "inertia")
TABLE = re.compile(r"^(?=[ \t]*\[\[)", re.MULTILINE)
LINE_END = re.compile(rb"(?<!\r)\n")
BOM = b"\xef\xbb\xbf"


class OwnToml(OwnFile):
    """A TOML file with new mass, com and inertia of [[link]], and damping and friction of [[joint]]."""

    def written(self, links: Mapping[str, LinkMass], friction: Friction) -> bytes:
        """Return the edited file, see OwnFile."""
        written = b"".join(
            self._part(part, links, friction) for part in _parts(self.data.removeprefix(BOM).decode())
        )
        if b"\r\n" in self.data:
            written = LINE_END.sub(b"\r\n", written)  # new lines end as the others do
        return (BOM if self.data.startswith(BOM) else b"") + written

    def _part(self, part: str, links: Mapping[str, LinkMass], friction: Friction) -> bytes:
        document = extra("tomlkit").parse(part)
        for what in ("link", "joint"):
            if isinstance(document.get(what), dict):
                raise NotWrittenBack(
                    f"{self.path.name} has a table of [[{what}]] behind other tables; move it to its {what}"
                )
        for link in document.get("link", ()):
            if (carried := links.get(link["name"])) is not None:
                _carry(link, carried)
        for joint in document.get("joint", ()):
            for what, text in friction.get(joint["name"], {}).items():
                joint[what] = float(text)
        return str(document.as_string()).encode()

    def lost(self, friction: Mapping[str, Array]) -> Iterator[str]:
        """Yield what OwnFile does, and formulas that numbers have replaced."""
        yield from super().lost(friction)
        formulas = [
            link["name"]
            for link in toml_data(self.path).get("link", ())
            if any(isinstance(value, str) for key in KEYS for value in _values(link.get(key, 0.0)))
        ]
        if formulas:
            yield (
                f"{self.path.name} had formulas in mass, com or inertia of {listed(formulas)}, in whose "
                "place there are numbers"
            )


def _parts(text: str) -> Iterator[str]:
    """Yield the parts of the file, cut before each [[...]].

    In a whole file tomlkit would put all tables of one name together. A line inside a value that begins so
    is no cut: the text before it is no TOML by itself.
    """
    part = ""
    for piece in TABLE.split(text):
        if part and _is_toml(part):
            yield part
            part = ""
        part += piece
    yield part


def _is_toml(text: str) -> bool:
    try:
        tomllib.loads(text)
    except tomllib.TOMLDecodeError:
        return False
    return True


def _values(said: Any) -> Iterable[Any]:
    return said.values() if isinstance(said, dict) else said if isinstance(said, list) else (said,)


def _carry(link: Any, carried: LinkMass) -> None:
    link["mass"] = carried.mass
    if "com" in link:
        for at, value in enumerate(carried.com.tolist()):
            link["com"][at] = value  # comments between them stay
    elif carried.com.any():
        link["com"] = carried.com.tolist()
    moments = {e: float(carried.inertia["xyz".index(e[0]), "xyz".index(e[1])]) for e in INERTIA}
    own = link.setdefault("inertia", extra("tomlkit").inline_table())
    for key, value in moments.items():
        if value or key in own:
            own[key] = value
