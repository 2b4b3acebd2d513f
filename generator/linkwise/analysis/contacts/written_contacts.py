"""Contacts written as short texts in commands and study files."""

from collections.abc import Sequence
from pathlib import Path

from linkwise_runtime.quantities import Contact

from linkwise.analysis.body_names import named_body
from linkwise.analysis.contacts.given_contacts import Contacts, WhileColumn
from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.errors import LinkwiseError

NUMBERS = {"held": (), "point": (), "hinged": ("AX", "AY", "AZ"), "rolling": ("RADIUS",)}
"""Names of the numbers that follow each kind of contact."""


def chosen_contacts(
    contact: Sequence[str],
    while_above: Sequence[str],
    loads: Sequence[Path],
    threshold: float | None,
    cutoff: float | None,
    unactuated: Sequence[str],
    robot: LoadedRobot,
) -> Contacts:
    """Return the contacts that the flags describe; raise LinkwiseError for text of any other form.

    cutoff: cutoff of the low-pass filter for loads, in Hz
    """
    given = tuple(_contact(text, robot) for text in contact)
    columns: dict[str, WhileColumn] = {}
    for text in while_above:
        name, column = _while(text, [contact.name or "" for contact in given])
        if name in columns:
            raise LinkwiseError(f"--contact-while {text}: {name} has one already; give one for each contact")
        columns[name] = column
    low = cutoff if loads else None
    return Contacts(given, columns, tuple(loads), threshold, low, tuple(unactuated))


def _contact(text: str, robot: LoadedRobot) -> Contact:
    """Return the contact of a text [NAME:]FRAME=KIND[,NUMBERS][@X,Y,Z]."""
    where, sign, rest = text.rpartition("=")
    what, at, place = rest.partition("@")
    kind, *numbers = what.split(",")
    if not (sign and where and kind in NUMBERS):
        raise LinkwiseError(
            f"--contact {text}: write it as FRAME=KIND@X,Y,Z, the kind one of {', '.join(NUMBERS)}"
        )
    named = ",".join((kind, *NUMBERS[kind]))
    try:
        more = [float(number) for number in numbers]
        x, y, z = (float(number) for number in place.split(",")) if at else (0.0, 0.0, 0.0)
    except ValueError:
        raise LinkwiseError(f"--contact {text}: write it as FRAME={named}@X,Y,Z, in m") from None
    if len(more) != len(NUMBERS[kind]):
        raise LinkwiseError(f"--contact {text}: write it as FRAME={named}@X,Y,Z, in m")
    name, frame = named_body(where, robot)
    made = Contact(frame, kind, (x, y, z), name=name or frame)
    if kind == "hinged":
        return made._replace(axis=(more[0], more[1], more[2]))
    return made._replace(radius=more[0]) if more else made


def _while(text: str, names: Sequence[str]) -> tuple[str, WhileColumn]:
    """Return the name and column of a text NAME=COLUMN[>VALUE]; the name may have an equals sign."""
    name, sign, rest = text.partition("=")
    for own in names:
        if text.startswith(f"{own}=") and len(own) > len(name):
            name, rest = own, text[len(own) + 1 :]
    column, above, value = rest.rpartition(">")
    try:
        found = WhileColumn(column, float(value)) if above else WhileColumn(rest)
    except ValueError:
        found = WhileColumn(rest)
    if not (sign and name and rest):
        raise LinkwiseError(f"--contact-while {text}: write it as NAME=COLUMN>VALUE")
    return name, found
