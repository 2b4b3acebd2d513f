"""An analysis made visible: figures by name, drawn with matplotlib, and the page."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.paper_figure import paper
from linkwise.analysis.show.power_figure import power
from linkwise.analysis.show.shares_figure import shares
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.plotstyle import saved, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURES: dict[str, Callable[[AnalysisResult, int], "Figure"]] = {
    "paper": paper,
    "shares": shares,
    "power": power,
}


def draw(result: AnalysisResult, name: str) -> "Figure":
    """Draw "paper", "shares", "power", or "paper:JOINT" for another loaded joint than the first.

    Raises LinkwiseError for another name.
    """
    check_figure(name, result.robot)
    kind, _, joint = name.partition(":")
    with styled():
        return FIGURES[kind](result, result.robot.joints.index(joint) if joint else result.robot.driven[0])


def figure_png(result: AnalysisResult, name: str) -> bytes:
    """Bytes of a figure's PNG, the same on each run; raises as `draw` does."""
    with styled():
        return saved(draw(result, name), "png", dpi=160)


def check_figure(name: str, robot: LoadedRobot) -> None:
    """Raise LinkwiseError unless `draw` knows the figure."""
    kind, _, joint = name.partition(":")
    if kind not in FIGURES or (joint and (kind != "paper" or joint not in robot.driven_joints)):
        raise LinkwiseError(
            f"--figure {name}: give one of {', '.join(FIGURES)}, or paper:JOINT with a joint of"
            f" {listed(robot.driven_joints)}"
        )
