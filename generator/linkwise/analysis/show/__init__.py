"""Views of an analysis: figures by name, drawn with matplotlib, and the page."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from linkwise_runtime.chosen_names import nearest_first

from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.causes_figure import causes
from linkwise.analysis.show.contacts_figure import contacts
from linkwise.analysis.show.induced_figure import induced
from linkwise.analysis.show.paper_figure import paper
from linkwise.analysis.show.power_figure import power
from linkwise.analysis.show.reaction_figure import reaction
from linkwise.analysis.show.shares_figure import shares
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.plotstyle import saved, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURES: dict[str, Callable[[AnalysisResult, int], "Figure"]] = {
    "paper": paper,
    "shares": shares,
    "causes": causes,
    "power": power,
    "induced": induced,
    "reaction": reaction,
    "contacts": contacts,
}


def draw(result: AnalysisResult, name: str) -> "Figure":
    """Draw one of FIGURES by its name.

    The names "paper:JOINT", "causes:JOINT", "induced:POINT" and "reaction:JOINT" choose another joint or
    point than the first.

    Raises LinkwiseError for another name.
    """
    check_figure(name, result.robot, result.induced, result.reactions)
    kind, _, chosen = name.partition(":")
    asked = {"induced": result.induced, "reaction": result.reactions}
    names = asked.get(kind, result.robot.joints)
    with styled():
        first = 0 if kind in asked else result.robot.moving_itself[0]
        return FIGURES[kind](result, names.index(chosen) if chosen else first)


def figure_png(result: AnalysisResult, name: str) -> bytes:
    """Return the bytes of a figure's PNG, the same on each run; raise as `draw` does."""
    with styled():
        return saved(draw(result, name), "png", dpi=160)


def check_figure(name: str, robot: OpenedRobot, points: Sequence[str], borne: Sequence[str]) -> None:
    """Raise LinkwiseError unless `draw` knows the figure.

    points: those of induced accelerations; borne: joints whose reactions are told
    """
    kind, _, joint = name.partition(":")
    for own, asked, what in (("induced", points, "POINT"), ("reaction", borne, "JOINT")):
        if kind == own:
            if not asked or (joint and joint not in asked):
                raise LinkwiseError(f"--figure {name}: add --{own} {joint or what}, whose shares it draws")
            return
    if kind == "contacts" and robot.contacts is None and not joint:
        raise LinkwiseError(f"--figure {name}: add --contact, whose forces it draws")
    if kind not in FIGURES or (
        joint and (kind not in ("paper", "causes") or joint not in robot.driven_joints)
    ):
        raise LinkwiseError(
            f"--figure {name}: give one of {', '.join(FIGURES)}, causes:JOINT or paper:JOINT with a joint of"
            f" {listed(nearest_first(joint, robot.driven_joints))}, induced:POINT or"
            " reaction:JOINT"
        )
