"""Views of an analysis: figures by name, drawn with matplotlib, and the page."""

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from linkwise_runtime.chosen_names import nearest_first

from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.show.causes_figure import causes
from linkwise.analysis.show.contacts_figure import contacts
from linkwise.analysis.show.cutoff_figure import cutoff
from linkwise.analysis.show.energy_figure import energy
from linkwise.analysis.show.induced_figure import induced_panels
from linkwise.analysis.show.paper_figure import paper
from linkwise.analysis.show.power_figure import power
from linkwise.analysis.show.reaction_figure import reaction_panels
from linkwise.analysis.show.shares_figure import shares
from linkwise.analysis.show.sourced_panels import figure_of
from linkwise.analysis.show.trace_figure import trace_panels
from linkwise.errors import LinkwiseError
from linkwise.escape import listed
from linkwise.plotstyle import FigureFormat, saved, styled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FIGURES: dict[str, Callable[[AnalysisResult, int], "Figure"]] = {
    "paper": paper,
    "shares": shares,
    "causes": causes,
    "power": power,
    "induced": figure_of(induced_panels),
    "energy": energy,
    "reaction": figure_of(reaction_panels),
    "trace": figure_of(trace_panels),
    "contacts": contacts,
    "cutoff": cutoff,
}


def draw(result: AnalysisResult, name: str) -> "Figure":
    """Draw one of FIGURES by its name.

    The names "paper:JOINT", "causes:JOINT", "induced:POINT", "reaction:JOINT" and "trace:JOINT" choose
    another joint or point than the first, "energy:PHASE" a phase in place of the whole movement.

    Raises LinkwiseError for another name.
    """
    result.require()
    told = names_of(result)
    check_figure(name, result.robot, told)
    kind, _, chosen = name.partition(":")
    asked = told.get(kind)
    names = result.robot.joints if asked is None else asked
    first = result.robot.moving_itself[0] if asked is None else 0
    with styled():
        return FIGURES[kind](result, names.index(chosen) if chosen else first)


def figure_bytes(result: AnalysisResult, name: str, kind: FigureFormat = "png") -> bytes:
    """Return the bytes of a figure in a format, the same on each run; raise as `draw` does."""
    with styled():
        return saved(draw(result, name), kind, dpi=160)


FigureNames = Mapping[str, Sequence[str]]
"""Names that may follow the kind of a figure, such as points that were asked for; none where nothing was."""
ASKED_BY = {
    "induced": "--induced {}, whose shares it draws",
    "reaction": "--reaction {}, whose shares it draws",
    "energy": "--induced-power, whose flows it draws",
    "trace": "--trace {}, whose sources it draws",
    "cutoff": "--cutoff-sweep, whose sizes it draws",
}
"""Flags, after `add`, by which the names of a figure are asked for."""


def figure_names(
    induced: Sequence[str],
    reactions: Sequence[str],
    flows: bool,
    phases: Sequence[str],
    traced: Sequence[str],
    swept: bool,
) -> FigureNames:
    """Return the names of figures, from the points, joints and phases that were asked for.

    flows: whether power by source is told; traced: joints of a trace; swept: whether cutoffs are swept
    """
    energies, sweeps = ("", *phases) if flows else (), ("",) if swept else ()
    asked = {"induced": induced, "reaction": reactions, "energy": energies, "trace": traced}
    return {**asked, "cutoff": sweeps}


def names_of(result: AnalysisResult) -> FigureNames:
    """Return the names of the figures of a result."""
    phases = [phase.name for phase in result.phases]
    traced = () if result.traced is None else result.traced["joints"]
    swept = result.cutoff_sweep is not None
    return figure_names(result.induced, result.reactions, "gain" in result.rows, phases, traced, swept)


def check_figure(name: str, robot: OpenedRobot, told: FigureNames) -> None:
    """Raise LinkwiseError unless `draw` knows the figure."""
    kind, _, joint = name.partition(":")
    if kind in told and (kind != "cutoff" or not joint):
        names = told[kind]
        if names and kind == "energy" and joint not in names:
            raise LinkwiseError(f"--figure {name}: add --phase {joint}=..., over which it sums up work")
        if not names or (joint and joint not in names):
            word = joint or ("POINT" if kind == "induced" else "JOINT")
            raise LinkwiseError(f"--figure {name}: add {ASKED_BY[kind].format(word)}")
        return
    if kind == "contacts" and robot.contacts is None and not joint:
        raise LinkwiseError(f"--figure {name}: add --contact, whose forces it draws")
    if kind not in FIGURES or (
        joint and (kind not in ("paper", "causes") or joint not in robot.driven_joints)
    ):
        raise LinkwiseError(
            f"--figure {name}: give one of {', '.join(FIGURES)}, causes:JOINT or paper:JOINT with a joint of"
            f" {listed(nearest_first(joint, robot.driven_joints))}, induced:POINT,"
            " reaction:JOINT or trace:JOINT"
        )
