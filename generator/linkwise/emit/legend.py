"""Meaning of the names that intermediate values have in closed forms."""

from linkwise.render import render


def names_told(by_rule: bool) -> str:
    """Return the names with their meaning: of the rule for rigid links, or of differentiated energies."""
    return render("closed_forms/legend.j2", {"by_rule": by_rule})
