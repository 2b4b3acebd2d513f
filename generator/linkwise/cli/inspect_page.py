"""One page of `inspect` on a robot: its size, what matters, and the first rows of each table."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

from linkwise.cli import counted
from linkwise.cli.inspect_gravity import gravity_line
from linkwise.escape import listed, printable, short

ROWS = 8
"""Most rows of a table on the page."""
SUBJECTS = 4
"""Most subjects of a remark; if there are fewer, they are shown with their details."""
LONGEST = 90
"""Most characters of a subject with its details."""
SHARES = "shares (of torques; of what, in which links)"
"""Title of the table of shares that have a name."""
OF_DETAILS = ("constraint", "promoted")
"""Kinds of remarks that tables with --details contain."""

Row = Callable[[int, dict[str, Any]], str]


def page(
    data: dict[str, Any], ground: Sequence[str] | None, joint: Row, link: Row, held: Row, share: Row
) -> str:
    """Return lines for a person, of `inspection`'s data; no more for a large robot than for a small one.

    ground: frames that stand still, none on a floating base; None where that is not known
    joint, link, held, share: functions for the row of one of them, held being a constraint, with its number
    from 1
    """
    lines = [_title(data)]
    if ground is not None:
        lines.append(
            f"base: fixed; on the ground: {listed(ground, SUBJECTS)}" if ground else "base: floating"
        )
    if "gravity" in data:
        lines.append(gravity_line(data))
    if data["refused"]:
        lines.append(f"refused by generate: {data['refused']}")
    lines += _remarks(note for note in data["notes"] if note["effect"])
    lines += _rows("joints", data["joints"], joint)
    lines += _rows("links (mass; moved by)", data["links"], link)
    lines += _rows("constraints (of `robot.constraints`; on what)", data.get("constraints", ()), held)
    if "independent" in data:
        lines += [f"  {what}: {listed(data[what], ROWS)}" for what in ("independent", "dependent")]
    lines += _rows(SHARES, data.get("shares", ()), share)
    lines += varying(data)
    if data["parameters"]:
        count = counted(len(data["parameters"]), "parameter")
        lines += ["", f"{count} (of `load`, generated with --parameters symbolic or nonzero)"]
    lines += ["", *_remarks(note for note in data["notes"] if not note["effect"])]
    return "\n".join(map(printable, (*lines, "--details shows all")))


def varying(data: dict[str, Any]) -> list[str]:
    """Return lines on time and inputs, if energies have them."""
    given = [f"time: {data['time']}"] if data.get("time") else []
    given += [f"inputs: {listed(data['inputs'], ROWS)}"] if data.get("inputs") else []
    return ["", f"given at run time (robot.at): {'; '.join(given)}"] if given else []


def _title(data: dict[str, Any]) -> str:
    masses = [link["mass"] for link in data["links"] if link["mass"] is not None]
    total = f", {sum(masses):.6g} kg that move" if masses else ""
    joints, links = (counted(len(data[f"{what}s"]), what) for what in ("joint", "link"))
    return f"{data['name']}: {joints}, {links}{total}"


def _rows(title: str, items: Sequence[dict[str, Any]], row: Row) -> Iterator[str]:
    if items:
        yield from ("", title, *(row(k, item) for k, item in enumerate(items[:ROWS], 1)))
    if len(items) > ROWS:
        yield f"  and {len(items) - ROWS} more"


def _remarks(notes: Iterable[dict[str, Any]]) -> Iterator[str]:
    """Yield a line for each kind of remark with one effect: how many there are, and the first subjects."""
    groups: dict[tuple[str, str], list[dict[str, Any]]] = {}
    for note in notes:
        if note["kind"] not in OF_DETAILS:
            groups.setdefault((note["kind"], note["effect"]), []).append(note)
    for (kind, effect), found in groups.items():
        few = len(found) < SUBJECTS
        items = [_subject(note, few) for note in found]
        count = f" {len(found)}" if not few else ""
        yield f"{kind}{count}: {listed(items, SUBJECTS, LONGEST)}{f'; {effect}' if effect else ''}"


def _subject(note: dict[str, Any], whole: bool) -> str:
    counts = note["detail"].endswith("×")
    return short(
        f"{note['subject']} {note['detail']}".rstrip() if whole or counts else note["subject"], LONGEST
    )
