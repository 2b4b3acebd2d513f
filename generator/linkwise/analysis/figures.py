"""Figures by name, drawn with matplotlib."""

from collections.abc import Callable
from typing import TYPE_CHECKING

from linkwise.analysis.extras import extra
from linkwise.analysis.paper_figure import paper
from linkwise.analysis.result import Analysis
from linkwise.analysis.robot import Robot
from linkwise.analysis.shares_figure import shares
from linkwise.errors import LinkwiseError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURES: dict[str, Callable[[Analysis, int], "Figure"]] = {"paper": paper, "shares": shares}

STYLE = {
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#E3E6EA",
    "axes.titlesize": 10,
    "axes.titlelocation": "left",
    "text.parse_math": False,  # a joint may be called a$b
}


def draw(analysis: Analysis, name: str) -> "Figure":
    """Draw "paper", "shares", or "paper:JOINT" for another loaded joint than the first."""
    check_name(name, analysis.robot)
    kind, _, joint = name.partition(":")
    with extra("matplotlib").rc_context(STYLE):
        return FIGURES[kind](analysis, analysis.robot.joints.index(joint) if joint else 0)


def check_name(name: str, robot: Robot) -> None:
    """Raise LinkwiseError unless `draw` knows the figure."""
    kind, _, joint = name.partition(":")
    if kind not in FIGURES or (joint and (kind != "paper" or joint not in robot.joints)):
        raise LinkwiseError(
            f"--figure {name}: give one of {', '.join(FIGURES)}, or paper:JOINT with a joint of"
            f" {', '.join(robot.joints)}"
        )
