"""Setup files of OpenSim's AnalyzeTool with InducedAccelerations, as the options of `linkwise analyze`.

A setup says what a command line says otherwise: the log, the robot, and options by their keys. What it asks
beyond that is refused where results would be others, and told where it is left out.
"""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element

from linkwise_runtime.chosen_names import nearest_first

from linkwise.analysis.induced_points import CENTRE, JOINTS
from linkwise.analysis.opensim.constraints import as_contacts
from linkwise.analysis.opensim.induced_storage import CENTRE as CENTRE_OF_MASS
from linkwise.errors import LinkwiseError, within
from linkwise.escape import listed
from linkwise.input_file import require_file
from linkwise.robot.notes import effects
from linkwise.robot.readers.osim.constraints import coordinate_rules
from linkwise.robot.readers.osim.document import (
    LARGEST,
    as_xml,
    members,
    name_of,
    numbers_of,
    read_document,
    text_of,
    yes,
)
from linkwise.robot.readers.osim.reader import gives_torque
from linkwise.robot.readers.xml_file import parse
from linkwise.robot.readers.xml_names import Known, ignored, names

TOOL, ANALYSIS = "AnalyzeTool", "InducedAccelerations"
NONE = ("", "Unassigned")
"""Texts that OpenSim writes where nothing is given."""
ALL = "all"
INITIAL, FINAL, THRESHOLD = "0", "1", "6"
"""Times in s, and a force in N, that OpenSim takes where a setup does not say."""
ORDER = 3
"""Order of OpenSim's low-pass, of one pass."""
KNOWN = {
    TOOL: Known(
        once=names(
            "model_file replace_force_set force_set_files initial_time final_time AnalysisSet ControllerSet "
            "external_loads_file states_file coordinates_file speeds_file "
            "lowpass_cutoff_frequency_for_coordinates"
        ),
        attributes=names("name"),
        idle=names(
            "results_directory output_precision solve_for_equilibrium_for_auxiliary_states defaults "
            "maximum_number_of_integrator_steps maximum_integrator_step_size minimum_integrator_step_size "
            "integrator_error_tolerance"
        ),
    ),
    ANALYSIS: Known(
        once=names(
            "on start_time end_time step_interval in_degrees coordinate_names body_names ConstraintSet "
            "force_threshold compute_potentials_only report_constraint_reactions"
        ),
        attributes=names("name"),
    ),
}
"""Names that are read of the tool and of the analysis."""


@dataclass(frozen=True)
class InducedSetup:
    """A setup as a command line: the log, the robot's file, and options by their keys.

    told: lines on what of the setup is left out
    """

    log: Path
    robot: Path
    options: dict[str, Any]
    told: tuple[str, ...]


def read_setup(path: Path) -> InducedSetup:
    """Return what a setup file asks for; its paths are relative to it.

    Raises LinkwiseError, which names the file and the element, for what is no such setup, names that no model
    has, files that are missing, and what is not modelled.
    """
    with within(str(path)):
        require_file(path)
        tool = _tool(parse(path, LARGEST, as_xml))
        analysis, told = _analysis(tool)
        told += effects(ignored([tool, analysis], lambda element: KNOWN.get(str(element.tag)), TOOL))
        told += _left_out(tool, analysis)
        log, robot, loads = _files(path, tool)
        added = _forces(path, tool)
    with within(str(robot)):
        model = read_document(robot).model
    with within(str(path)):
        (threshold,) = numbers_of(analysis, "force_threshold", THRESHOLD, f"<{ANALYSIS}>", 1)
        contacts = as_contacts(analysis, model, loads, threshold)
        points = _points(analysis, model)
        told += _without_muscles(added, [] if yes(tool, "replace_force_set") else members(model, "ForceSet"))
        told += _without_file(model) if JOINTS in points else ()
        options = {
            "ignore_extra": True,
            "induced": points,
            "induced_whole": True,
            "sto": f"{name_of(tool)}_{name_of(analysis)}",
            "sto_units": "deg" if yes(analysis, "in_degrees", True) else "rad",
            **_times(tool, analysis),
            **_filter(tool),
            **contacts.options,
        }
    return InducedSetup(log, robot, options, (*told, *contacts.told))


def _files(path: Path, tool: Element) -> tuple[Path, Path, Path | None]:
    """Return the log, the model and, if there are some, the external loads."""
    robot = _file(path, tool, "model_file")
    if robot is None:
        raise LinkwiseError(f"<{TOOL}> has no model_file; name the .osim file there")
    log = _file(path, tool, "states_file") or _file(path, tool, "coordinates_file")
    if log is None:
        raise LinkwiseError(f"<{TOOL}> has neither coordinates_file nor states_file; name the motion there")
    return log, robot, _file(path, tool, "external_loads_file")


def _tool(root: Element) -> Element:
    tool = root if root.tag == TOOL else root.find(TOOL)
    if tool is None:
        there = listed([f"<{child.tag}>" for child in root] or [f"<{root.tag}>"])
        raise LinkwiseError(f"there is {there}, and no <{TOOL}>; give a setup of OpenSim's analyze tool")
    return tool


def _analysis(tool: Element) -> tuple[Element, list[str]]:
    """Return the analysis that is on, and lines on other analyses."""
    every = list(tool.findall("AnalysisSet/objects/*"))
    found = [one for one in every if one.tag == ANALYSIS and yes(one, "on", True)]
    if len(found) != 1:
        there = listed([f"<{one.tag}>" for one in every]) or "nothing"
        raise LinkwiseError(
            f"<AnalysisSet> has {there}, {len(found)} <{ANALYSIS}> that are on; one is carried out"
        )
    others = [f"{one.tag} {name_of(one)!r} is left out" for one in every if one is not found[0]]
    return found[0], others


def _left_out(tool: Element, analysis: Element) -> Iterator[str]:
    """Yield lines on what is left out; raise LinkwiseError for what would change the results."""
    if yes(analysis, "compute_potentials_only"):
        raise LinkwiseError(
            "compute_potentials_only asks what muscles could do at a force of 1 N; sources are the torques of"
            " joints here: set it to false"
        )
    if yes(analysis, "report_constraint_reactions"):
        yield "report_constraint_reactions: no such file is written; columns force/… of the table have them"
    (interval,) = numbers_of(analysis, "step_interval", "1", f"<{ANALYSIS}>", 1)
    if interval != 1:
        yield f"step_interval {interval:g}: every sample is written"
    if _told(tool, "states_file") and _told(tool, "coordinates_file"):
        yield "coordinates_file: the motion is that of states_file, which is not filtered"
    if _told(tool, "speeds_file"):
        yield "speeds_file: velocities are those of the coordinates"
    if tool.find("ControllerSet/objects/*") is not None:
        yield "ControllerSet: torques are those of the motion"


def _forces(path: Path, tool: Element) -> list[Element]:
    """Return the forces of files that a setup adds to those of the model."""
    found: list[Element] = []
    for name in _told(tool, "force_set_files").split():
        file = path.parent / name.replace("\\", "/")
        with within(f"force_set_files {file}"):
            require_file(file)
            found += parse(file, LARGEST, as_xml).iterfind("ForceSet/objects/*")
    return found


def _without_muscles(added: Sequence[Element], own: Iterable[Element]) -> Iterator[str]:
    """Yield lines on forces that are no sources: muscles, and those of files that act by themselves.

    own: forces of the model; those that act by themselves are told of where it is read
    """
    count = sum(gives_torque(force) for force in (*added, *own))
    if count:
        yield f"sources are the torques of coordinates, in place of {count} muscles and actuators"
    for force in added:
        if not gives_torque(force):
            yield f"force_set_files: {force.tag} {name_of(force)!r} is left out"


def _times(tool: Element, analysis: Element) -> dict[str, float]:
    """Return the options of the range of time, where it is bounded."""
    place = f"<{TOOL}>", f"<{ANALYSIS}>"
    (start,), (end,) = (
        numbers_of(tool, tag, usual, place[0], 1)
        for tag, usual in (("initial_time", INITIAL), ("final_time", FINAL))
    )
    (first,), (last,) = (
        numbers_of(analysis, tag, usual, place[1], 1)
        for tag, usual in (("start_time", "-Inf"), ("end_time", "Inf"))
    )
    given = {"from_time": max(start, first), "to_time": min(end, last)}
    return {key: time for key, time in given.items() if not math.isinf(time)}


def _filter(tool: Element) -> dict[str, float | int]:
    """Return the options of the filter; OpenSim filters coordinates, and not states."""
    (cutoff,) = numbers_of(tool, "lowpass_cutoff_frequency_for_coordinates", "-1", f"<{TOOL}>", 1)
    is_filtered = not cutoff <= 0.0 and not _told(tool, "states_file")
    return {"cutoff": cutoff, "filter_order": ORDER} if is_filtered else {}


def _coordinates(model: Element) -> list[Element]:
    joints = (*members(model, "JointSet"), *members(model, "BodySet"))  # before OpenSim 4, bodies hold them
    return [one for joint in joints for one in joint.iter("Coordinate")]


def _without_file(model: Element) -> Iterator[str]:
    """Yield a line on each coordinate that doesn't move by itself, and so has no acceleration of its own."""
    for name, rule in coordinate_rules(_coordinates(model), model)[0].items():
        if rule.free != name:
            why = f"follows {rule.free!r}" if rule.free else "is locked"
            yield f"coordinate {name!r} {why}, and has no file"


def _points(analysis: Element, model: Element) -> list[str]:
    """Return the points whose acceleration is told; OpenSim tells that of a body's centre of mass."""
    bodies = {name_of(body): body for body in members(model, "BodySet")}
    coordinates = _listed(analysis, "coordinate_names", "", list(map(name_of, _coordinates(model))))
    wanted = _listed(analysis, "body_names", CENTRE_OF_MASS, [*bodies, CENTRE_OF_MASS])
    if not (coordinates or wanted):
        raise LinkwiseError("coordinate_names and body_names are empty; name what accelerates, or All")
    points = [JOINTS] if coordinates else []
    for name in wanted:
        if name == CENTRE_OF_MASS:
            points.append(CENTRE)
        elif name != "ground":
            at = numbers_of(bodies[name], "mass_center", "0 0 0", f"body {name!r}", 3)
            points.append(f"{name},{','.join(map(repr, at))}" if any(at) else name)
    return points if CENTRE in points else [*points, CENTRE]  # of which OpenSim always writes a file


def _listed(analysis: Element, tag: str, usual: str, there: list[str]) -> list[str]:
    """Return the names in a list, each once; all of the model's where it says so.

    Raises LinkwiseError for a name that the model does not have.
    """
    text = text_of(analysis, tag) if analysis.find(tag) is not None else usual
    lower = {name.lower(): name for name in (ALL, CENTRE_OF_MASS)}  # OpenSim takes capitals in these two
    words = [lower.get(word.lower(), word) for word in text.split()]
    for word in words:
        if word not in (*there, ALL):
            near = listed(map(repr, nearest_first(word, there)))
            raise LinkwiseError(f"{tag}: the model has no {word!r}; it has {near}, and All is all of them")
    if ALL in words:
        words = [name for name in there if name != CENTRE_OF_MASS or name in words]
    return list(dict.fromkeys(words))


def _told(element: Element, tag: str) -> str:
    text = text_of(element, tag)
    return "" if text in NONE else text


def _file(path: Path, tool: Element, tag: str) -> Path | None:
    """Return the path that an element names, relative to the setup; None where it names none.

    Raises LinkwiseError for a file that is not there.
    """
    told = _told(tool, tag)
    if not told:
        return None
    found = path.parent / told.replace("\\", "/")
    with within(f"{tag} {found}"):
        require_file(found)
    return found
