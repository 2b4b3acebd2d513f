"""Names of components that have none, or that of another: as OpenSim gives them when it loads a model."""

from collections.abc import Iterable, Iterator
from xml.etree.ElementTree import Element

from linkwise.robot.notes import Note

NAMED = "named so here, as OpenSim does where a name is empty or another's"


def give_own_names(components: Iterable[Element]) -> Iterator[Note]:
    """Give each component a name of its own, and yield a note on each that had none.

    An empty name becomes that of the component's class in small letters; of equal ones, those behind the
    first get the first free of _0, _1, … at their end. What refers to such a name means the first.
    """
    taken: set[str] = set()
    for component in components:
        told = component.get("name", "").strip()
        name = base = told or component.tag.lower()
        number = 0
        while name in taken:
            name, number = f"{base}_{number}", number + 1
        taken.add(name)
        if name != component.get("name"):
            component.set("name", name)
        if name != told:
            yield Note("warned", name, f"a {component.tag} {told!r}", NAMED)
