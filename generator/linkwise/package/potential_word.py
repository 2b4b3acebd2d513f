"""What people read the shares g_ij as: the one place that says it, for figures, pages, reports and C."""


def potential_word(is_rigid: bool) -> str:
    """Of rigid links gravity; of energies that a user wrote whatever their potentials are, springs too.

    What joints of rigid robots have of their own, springs among it, stands beside g_ij.
    """
    return "gravity" if is_rigid else "potential energy"
