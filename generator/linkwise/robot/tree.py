"""Tree of a description: its one root, the walk from it, the cutting of parts, and loops that are no tree."""

from collections import Counter
from collections.abc import Mapping
from dataclasses import replace

from linkwise_runtime.chosen_names import nearest_first

from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.robot.description import Connection, Description, Loop
from linkwise.robot.notes import Note
from linkwise.robot.robot import unusable


def depth_first(description: Description) -> tuple[str, tuple[Connection, ...]]:
    """Return the root link and the joints from it, parents first, siblings in the file's order.

    Raises LinkwiseError for a link with two parents, for several roots and for loops.
    """
    parents = Counter(c.child for c in description.connections)
    for link, count in parents.items():
        if count > 1:
            joints = ", ".join(repr(c.name) for c in description.connections if c.child == link)
            raise LinkwiseError(
                f"link {link!r} has {count} parents (joints {joints}); keep one, and close loops by "
                "constraints"
            )
    roots = [body.name for body in description.bodies if body.name not in parents]
    if not roots:
        raise LinkwiseError(
            f"the joints form a loop through link {description.bodies[0].name!r}; no link is the root"
        )
    if len(roots) > 1:
        raise LinkwiseError(
            f"there are several roots ({listed(map(repr, roots))}); connect them, or choose one with --root"
        )
    below: dict[str, list[Connection]] = {}
    for c in reversed(description.connections):
        below.setdefault(c.parent, []).append(c)
    order: list[Connection] = []
    stack = below.get(roots[0], [])[:]
    while stack:
        order.append(stack.pop())
        stack += below.get(order[-1].child, [])
    if len(order) != len(description.connections):
        lost = sorted({c.child for c in description.connections} - {c.child for c in order})
        raise LinkwiseError(
            f"link {lost[0]!r} cannot be reached from the root {roots[0]!r}: its joints form a loop"
        )
    return roots[0], tuple(order)


def _check_names(description: Description) -> None:
    links = [body.name for body in description.bodies]
    if not links:
        raise LinkwiseError("the robot has no link; give at least one")
    for what, names in (("link", links), ("joint", [c.name for c in description.connections])):
        for name, count in Counter(names).items():
            if not name.strip():
                raise LinkwiseError(f"a {what} has an empty name; name it")
            if count > 1:
                raise LinkwiseError(f"{count} {what}s are named {name!r}; rename all but one")
    known = set(links)
    for c in description.connections:
        for role, link in (("parent", c.parent), ("child", c.child)):
            if link not in known:
                near = listed(nearest_first(link, sorted(known)))
                raise LinkwiseError(
                    f"joint {c.name!r} has the {role} {link!r}, which is not a link; correct it or add one"
                    f"; the links are {near}"
                )
        mimic = (c.mimic.ratio, c.mimic.offset) if c.mimic else ()
        origin = (*c.translation, *(entry for row in c.rotation for entry in row))
        for what, values in (("mimic", mimic), ("origin", origin)):
            if fault := unusable(*values):
                raise LinkwiseError(f"joint {c.name!r} has {fault} in its {what}; give numbers")


def cut(description: Description, root: str | None, tip: str | None) -> Description:
    """Return the part from link `root` on, or only its chain to link `tip`, with notes on what was cut.

    Raises LinkwiseError for names that are empty, double or unknown, and for a `tip` that is not below
    `root`.
    """
    _check_names(description)
    known = {body.name for body in description.bodies}
    for flag, link in (("--root", root), ("--tip", tip)):
        if link is not None and link not in known:
            near = listed(nearest_first(link, sorted(known)))
            raise LinkwiseError(f"{flag} {link!r} is not a link; the links are {near}")
    kept = known if root is None else _below(description, root)
    if tip is not None:
        parent = {c.child: c.parent for c in description.connections if c.parent in kept}
        chain, at = {tip}, tip
        while at in parent and at != root and parent[at] not in chain:
            at = parent[at]
            chain.add(at)
        if root is not None and root not in chain:
            raise LinkwiseError(f"--tip {tip!r} is not below --root {root!r}; choose links of one chain")
        kept &= chain
    gone = tuple(Note("cut", body.name) for body in description.bodies if body.name not in kept)
    return replace(
        description,
        notes=(*description.notes, *gone),
        bodies=tuple(b for b in description.bodies if b.name in kept),
        free=description.free if root is None else None,  # the frame of `root` is the world's
        connections=tuple(c for c in description.connections if c.parent in kept and c.child in kept),
    )


def _below(description: Description, root: str) -> set[str]:
    """Return link `root` and the links that it carries."""
    kept, frontier = {root}, [root]
    while frontier:
        new = [c.child for c in description.connections if c.parent in frontier and c.child not in kept]
        kept, frontier = kept | set(new), new
    return kept


def check_loops(loops: tuple[Loop, ...], carrier: Mapping[str, int | None]) -> None:
    """Raise LinkwiseError for an unmodelled constraint, unless its bodies move as one or are cut away.

    `carrier` is the index of the moving link of each body that is there, None for the ground.
    """
    for loop in loops:
        if not loop.pairs or any(_acts(pair, carrier, loop.of_joints) for pair in loop.pairs):
            raise LinkwiseError(f"{loop.what}, which is not modelled: {loop.remedy}")


def _acts(pair: tuple[str, str], carrier: Mapping[str, int | None], of_joint: bool) -> bool:
    """Return whether a constraint between two bodies can load a moving link."""
    there = [carrier[body] for body in pair if body in carrier]
    if len(there) < 2:
        return not of_joint and any(link is not None for link in there)
    return there[0] != there[1]
