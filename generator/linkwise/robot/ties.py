"""Ties between bodies as ties between frames: frames for their ends, ties left after cutting and locking."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence

import sympy as sp
from linkwise_runtime.chosen_names import nearest_first
from linkwise_runtime.rule.joint_tree import TreeTie

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot import transforms
from linkwise.robot.description import Anchor, AnchoredTie, Body, Description, Site
from linkwise.robot.notes import LEFT_OUT, Note
from linkwise.robot.robot import Frame, Scalar, unusable

CLOSE = 1e-6
"""Distance in m by which ends that move as one may miss a tie without a warning."""

Ends = dict[str, tuple[str, str]]
"""Names of the two frames that a tie joins, by the tie's name."""


def anchor_frames(description: Description, taken: Iterable[str]) -> tuple[tuple[Site, ...], Ends]:
    """Return the file's sites and new ones for ends of ties that are no frame yet, and the names of all ends.

    `taken` are names of other frames. A new site is named after its tie, for example pin_first.
    """
    bodies, sites = description.bodies, description.sites
    known = {Anchor(body.name): body.name for body in bodies if not body.invented}
    used = {body.name for body in bodies} | set(taken)
    for site in sites:
        if site.name not in used:
            known.setdefault(Anchor(site.body, site.rotation, site.translation), site.name)
            used.add(site.name)
    made: list[Site] = []

    def name_of(anchor: Anchor, wanted: str) -> str:
        if anchor not in known:
            while wanted in used:
                wanted += "_"
            used.add(wanted)
            known[anchor] = wanted
            made.append(Site(wanted, anchor.body, anchor.rotation, anchor.translation))
        return known[anchor]

    ends = {
        tie.name: (name_of(tie.first, f"{tie.name}_first"), name_of(tie.second, f"{tie.name}_second"))
        for tie in description.ties
    }
    return (*sites, *made), ends


def check_ties(ties: Iterable[AnchoredTie], bodies: Iterable[Body], sites: Iterable[Site]) -> None:
    """Raise LinkwiseError for links that the file does not have, and for unusable numbers.

    sites: sites whose names could have been given as ends too
    """
    known = {body.name for body in bodies}
    names = [*sorted(known), *(site.name for site in sites)]
    for tie in ties:
        for anchor in (tie.first, tie.second):
            if anchor.body not in known:
                near = listed(nearest_first(anchor.body, names))
                raise LinkwiseError(
                    f"constraint {tie.name!r} ties {anchor.body!r}, which is not a link or a site; "
                    f"correct it: there are {near}"
                )
            if fault := unusable(*anchor.translation, *(e for row in anchor.rotation for e in row)):
                raise LinkwiseError(f"constraint {tie.name!r} has {fault} in its place; give numbers")
        if tie.first.body == tie.second.body:
            raise LinkwiseError(
                f"constraint {tie.name!r} ties link {tie.first.body!r} to itself; name two links"
            )
        length = _length(tie)
        if fault := unusable(length):
            raise LinkwiseError(f"constraint {tie.name!r} has {fault} for its length; give m")
        if tie.kind == "distance" and length <= 0:
            raise LinkwiseError(
                f"constraint {tie.name!r} has the length {length:g}; give one above 0, or the type point"
            )


def frame_ties(
    ties: Iterable[AnchoredTie],
    ends: Ends,
    frames: Sequence[Frame],
    values: Mapping[sp.Symbol, float],
) -> tuple[tuple[TreeTie, ...], list[Note]]:
    """Return the ties between frames that move against each other, and notes on the others.

    Raises LinkwiseError for a tie to a link that was cut away.
    """
    at = {frame.name: index for index, frame in enumerate(frames)}
    found: list[TreeTie] = []
    notes: list[Note] = []
    for tie in ties:
        there = [frames[at[name]] for name in ends[tie.name] if name in at]
        if len(there) < 2:
            if any(frame.link is not None for frame in there):
                raise LinkwiseError(_torn(tie, [name in at for name in ends[tie.name]]))
            notes.append(Note("cut", tie.name, "a constraint on links that are not there"))
        elif there[0].link == there[1].link:
            notes.append(_as_one(tie, there[0], there[1], values))
        else:
            first, second = (at[name] for name in ends[tie.name])
            found.append(TreeTie(tie.name, tie.kind, first, second, _length(tie)))
    return tuple(found), notes


def _length(tie: AnchoredTie) -> float:
    """Return the length in m; raises LinkwiseError for a formula, which generated code would not keep."""
    if isinstance(tie.length, float):
        return tie.length
    raise LinkwiseError(
        f"constraint {tie.name!r} has the length {tie.length}, which stays a number in generated code; "
        "generate with --parameters numeric, or write the number"
    )


def _torn(tie: AnchoredTie, there: list[bool]) -> str:
    kept, lost = (tie.first, tie.second) if there[0] else (tie.second, tie.first)
    return (
        f"constraint {tie.name!r} ties link {kept.body!r} to link {lost.body!r}, which --root or --tip cuts "
        "away; keep both, or remove the constraint from the file"
    )


def _as_one(tie: AnchoredTie, first: Frame, second: Frame, values: Mapping[sp.Symbol, float]) -> Note:
    """Return a note that both ends move as one, with the distance by which they miss the tie, if they do."""
    apart = transforms.add(first.translation, transforms.minus(second.translation))
    off = abs(math.hypot(*(float(sp.sympify(x).xreplace(dict(values))) for x in apart)) - _length(tie))
    if off <= CLOSE:
        return Note("ignored", tie.name, "a constraint whose ends move as one")
    detail = f"its ends move as one, {1000 * off:.3g} mm away from it"
    return Note("ignored", tie.name, detail, f"constraints {LEFT_OUT}")


def tied_places(ties: Iterable[TreeTie], frames: Sequence[Frame]) -> Iterator[tuple[str, Scalar]]:
    """Yield the numbers of ties that may contain parameters, each as (name, number)."""
    for tie in ties:
        for frame in (frames[tie.first], frames[tie.second]):
            for axis, value in zip("xyz", frame.translation, strict=True):
                yield f"place_{frame.name}_{axis}", value
