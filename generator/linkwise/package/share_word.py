"""Word for g_ij, all that has a name of its own, in one place for figures, pages, reports and C."""

from collections.abc import Sequence

from linkwise.escape import listed

MOST = 3
"""Most names that stand for themselves."""


def share_word(names: Sequence[str]) -> str:
    """Return the names of the shares that g_ij is the sum of, as a phrase: "gravity", "spring and gravity".

    Passive torques of the joints of rigid robots, springs among them, stand beside g_ij.
    """
    if not names:
        return "nothing beside motion"
    if len(names) > MOST:
        return listed(names, MOST)
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last
