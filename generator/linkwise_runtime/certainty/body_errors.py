"""Errors of uncertain bodies one by one: of masses, centres, radii, and of all parameters together."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from .parameter_moments import Floats, factor
from .uncertain_bodies import checked_correlation, known_parts, parameter_factor, place_covariances


class BodyErrors(NamedTuple):
    """Errors of bodies, each by itself, of one standard deviation."""

    masses: Sequence[Floats]
    """Parts by which masses are off, (N,) for each error."""
    centres: Sequence[tuple[int, Floats]]
    """Links, and by how much their centre is off in the axes of its frame in m, (3,)."""
    radii: Floats
    """Part by which each of a link's radii is off, (N,)."""
    parameters: Floats
    """Factor of what all inertial parameters are off by together, (N, 10, Q)."""


def body_errors(links: Sequence[str], axes: Floats, given: Any) -> BodyErrors:
    """Return the errors of bodies; arguments and errors raised are as of `body_spread`."""
    own, radii = (known_parts(links, name, getattr(given, name)) for name in ("masses", "radii"))
    places = axes @ place_covariances(links, "centres", given.centres) @ axes.mT
    part = known_parts(["body_mass"], "body_mass", given.body_mass)[0]
    together = checked_correlation(links, given.correlation) * np.outer(own, own)
    masses = [part * known_parts(links, "segments", given.segments), *factor(together).T]
    centres = [(j, shift) for j, place in enumerate(places) for shift in factor(place).T]
    parameters = parameter_factor(links, given.parameters)
    return BodyErrors([one for one in masses if one.any()], centres, radii, parameters)
