"""Robots whose bodies are off by one standard deviation, along each direction of their uncertainty."""

from dataclasses import replace
from typing import Any, cast

from linkwise_runtime.certainty.share_bounds import bodies_of
from linkwise_runtime.certainty.uncertain_bodies import body_axes, body_spread, tree_bodies
from linkwise_runtime.rule.joint_tree import Bodies
from linkwise_runtime.rule.regressors import inertial_parameters

from linkwise.analysis.constrained_model import ConstrainedModel
from linkwise.analysis.load_robot import coordinates_tied
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError


def perturbed_robots(robot: OpenedRobot, given: Any) -> list[tuple[OpenedRobot, OpenedRobot]]:
    """Return for each direction the robot ahead by one standard deviation, and that behind.

    given: an `UncertainBodies`, whose lengths do not count; raises LinkwiseError for a package without a back
    end that takes bodies, and ValueError as `body_spread` does
    """
    backend = next((name for name in ("numpy", "torch") if name in robot.package.backends), None)
    if backend is None:
        raise LinkwiseError(
            f"{robot.package.directory}: no back end takes other bodies; generate the robot again, with"
            " --backend numpy beside the others"
        )
    tree, own = robot.package.manifest.tree, robot.package.load(backend).backend
    assert tree is not None  # as `refuse_unmodelled` has seen
    carried = tree_bodies(tree, own.parameters, cast(Any, own.bodies))
    claimed = inertial_parameters(Bodies(*carried))
    spread = body_spread(robot.links[: len(tree.links)], carried, body_axes(tree), given)
    return [
        (_with(robot, backend, claimed + change), _with(robot, backend, claimed - change))
        for change in spread.factor.T.reshape(-1, *claimed.shape)
        if change.any()
    ]


def _with(robot: OpenedRobot, backend: str, parameters: Array) -> OpenedRobot:
    """Return the robot with other inertial parameters (N, 10)."""
    model: Any = robot.package.load(backend, bodies=bodies_of(parameters))
    tied = None
    if robot.constrained is not None:
        model = tied = ConstrainedModel.of(model, coordinates_tied(robot.package.manifest))
    if robot.payloads:
        model = replace(cast(Any, robot.model), own=model)
    return replace(robot, model=model, constrained=tied)
