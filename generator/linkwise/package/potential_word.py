"""The common word for the shares g_ij, in one place for figures, pages, reports and C."""


def potential_word(is_rigid: bool) -> str:
    """Return the word for g_ij: gravity of rigid links, else potential energy, which may include springs.

    Passive torques of the joints of rigid robots, springs among them, stand beside g_ij.
    """
    return "gravity" if is_rigid else "potential energy"
