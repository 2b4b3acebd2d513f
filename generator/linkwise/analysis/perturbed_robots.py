"""Robots whose bodies are off, along each of the errors that they may have.

Masses, centres and radii of gyration are off each by itself, as they err, so that bodies stay such as could
be: what is not linear in inertial parameters, as accelerations are not, follows from these.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any, NamedTuple, cast

import numpy as np
from linkwise_runtime.certainty.body_errors import body_errors
from linkwise_runtime.certainty.divided_differences import WIDTH
from linkwise_runtime.certainty.parameter_moments import principal_moments
from linkwise_runtime.certainty.share_bounds import bodies_of
from linkwise_runtime.certainty.uncertain_bodies import body_axes, tree_bodies
from linkwise_runtime.rule.joint_tree import Bodies
from linkwise_runtime.rule.regressors import inertial_parameters

from linkwise.analysis.constrained_model import ConstrainedModel
from linkwise.analysis.load_robot import coordinates_tied
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError

LIGHTEST = 0.1
"""Least part of its mass that a perturbed body keeps: with less, no acceleration may follow from torques."""


class PerturbedRobots(NamedTuple):
    """Robots that are ahead and behind along one error, by so many standard deviations."""

    ahead: OpenedRobot
    behind: OpenedRobot
    width: float


def perturbed_robots(robot: OpenedRobot, given: Any) -> list[PerturbedRobots]:
    """Return the robots that are off, for each error of their bodies.

    given: an `UncertainBodies`, whose lengths do not count; raises LinkwiseError for a package without a back
    end that takes bodies, and ValueError as `body_errors` does
    """
    backend = next((name for name in ("numpy", "torch") if name in robot.package.backends), None)
    if backend is None:
        raise LinkwiseError(f"{robot.package.called}: no back end takes other bodies; {robot.package.remedy}")
    tree, own = robot.package.manifest.tree, robot.package.load(backend).backend
    assert tree is not None  # as `refuse_unmodelled` has seen
    carried = tree_bodies(tree, own.parameters, cast(Any, own.bodies))
    links = robot.links[: len(tree.links)]
    return [
        PerturbedRobots(_with(robot, backend, bodies(width)), _with(robot, backend, bodies(-width)), width)
        for bodies, width in _errors(links, Bodies(*carried), body_axes(tree), given)
    ]


def _errors(
    links: tuple[str, ...], own: Bodies[Array], axes: Array, given: Any
) -> Iterator[tuple[Callable[[float], Bodies[Array]], float]]:
    """Yield for each error what bodies are at so many standard deviations of it, and how many tell most."""
    errors = body_errors(links, axes, given)
    for parts in errors.masses:

        def heavier(size: float, parts: Array = parts) -> Bodies[Array]:
            factor = 1.0 + size * parts
            return Bodies(own.masses * factor, own.centres, own.inertias * factor[:, None, None])

        yield heavier, WIDTH if WIDTH * np.abs(parts).max() < 1.0 - LIGHTEST else 1.0
    for j, shift in errors.centres:

        def moved(size: float, j: int = j, shift: Array = shift) -> Bodies[Array]:
            centres = own.centres.copy()
            centres[j] += size * shift
            return own._replace(centres=centres)

        yield moved, WIDTH
    for j, part in enumerate(errors.radii.tolist()):
        moments, principal = principal_moments(own.inertias[j], axes[j])
        for x in range(3) if part else ():
            change = moments[x] * np.outer(principal[:, x], principal[:, x])

            def longer(size: float, j: int = j, part: float = part, change: Array = change) -> Bodies[Array]:
                inertias = own.inertias.copy()
                inertias[j] += ((1.0 + size * part) ** 2 - 1.0) * change
                return own._replace(inertias=inertias)

            yield longer, WIDTH
    claimed = inertial_parameters(own)
    for change in np.moveaxis(errors.parameters, -1, 0):

        def other(size: float, change: Array = change) -> Bodies[Array]:
            return bodies_of(claimed + size * change)

        yield other, 1.0


def _with(robot: OpenedRobot, backend: str, bodies: Bodies[Array]) -> OpenedRobot:
    """Return the robot with other bodies."""
    model: Any = robot.package.load(backend, bodies=bodies)
    tied = None
    if robot.constrained is not None:
        model = tied = ConstrainedModel.of(model, coordinates_tied(robot.package.manifest))
    if robot.payloads:
        model = replace(cast(Any, robot.model), own=model)
    return replace(robot, model=model, constrained=tied)
