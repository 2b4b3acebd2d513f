"""Values of the elements of an OpenSim file."""

from xml.etree.ElementTree import Element

from linkwise.errors import LinkwiseError

BOOLEANS = {"true": True, "1": True, "false": False, "0": False}


def text_of(element: Element, tag: str, default: str = "") -> str:
    """Return the text of a child, or the default where it is empty or not there."""
    return (element.findtext(tag) or "").strip() or default


def numbers_of(element: Element, tag: str, default: str, place: str, count: int = 0) -> tuple[float, ...]:
    """Return the numbers of a child, or of the default where it is empty or not there.

    Raises LinkwiseError naming the place unless they are `count`; 0 allows any number of them.
    """
    text = text_of(element, tag, default)
    try:
        values = tuple(map(float, text.split()))
    except ValueError:
        values = ()
    if not values or (count and len(values) != count):
        wanted = f"{count} numbers" if count > 1 else "a number" if count else "numbers"
        raise LinkwiseError(f"{place}: <{tag}>{text}</{tag}> needs {wanted}")
    return values


def yes(element: Element, tag: str, default: bool = False) -> bool:
    """Return whether a child says true; raises LinkwiseError for neither true nor false."""
    text = text_of(element, tag, str(default))
    if text.lower() not in BOOLEANS:
        raise LinkwiseError(f"{element.tag} {name_of(element)!r}: <{tag}>{text}</{tag}> needs true or false")
    return BOOLEANS[text.lower()]


def name_of(element: Element) -> str:
    """Return the name of a component."""
    return element.get("name", "")
