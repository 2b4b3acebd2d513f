"""Segments of a robot, links that nothing moves apart: their energy, what flows between them, and the causes.

A segment is carried by another one, or by the ground, through one or several joints. What enters it is the
flow of the last of these joints; what its carrier gives is that before the first one. They differ by what the
joints give or take.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from linkwise.analysis.induced_sources import opened
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_quantities import LOSSES
from linkwise.arrays import Array

HANDED_ON, LOST = "handed on by velocities", "springs and losses"
"""Names of the work of velocity forces, which sums to zero over all segments, and of passive torques."""


@dataclass(frozen=True)
class Segment:
    """Links that the same joints move."""

    links: tuple[int, ...]
    joints: tuple[int, ...]
    """Joints between this segment and the one that carries it, that one's first."""
    carrier: int | None
    """Index of the segment that carries it; None for the ground."""


def segments_of(robot: OpenedRobot) -> tuple[Segment, ...]:
    """Return the segments, each behind its carrier, branch by branch.

    Links of energies are segments without joints: nothing says what carries them.
    """
    if robot.tree is None:
        return tuple(Segment((j,), (), None) for j in range(len(robot.links)))
    first: dict[int, int] = {}
    for at, joint in enumerate(robot.tree.joints):
        first.setdefault(joint.coordinate, at)
    paths: list[set[int]] = [set() for _ in robot.links]
    for i, j in np.asarray(opened(robot).layout.torque).tolist():
        paths[j].add(i)
    ordered = [tuple(sorted(path, key=first.__getitem__)) for path in paths]
    found: list[Segment] = []
    moved = sorted(set(ordered), key=lambda path: [first[i] for i in path])
    for path in moved:
        carriers = [at for at, other in enumerate(moved[: len(found)]) if set(other) < set(path)]
        carrier = max(carriers, key=lambda at: len(moved[at]), default=None)
        own = set(path) - set(moved[carrier] if carrier is not None else ())
        links = tuple(j for j, other in enumerate(ordered) if other == path)
        found.append(Segment(links, tuple(i for i in path if i in own), carrier))
    return tuple(found)


def energies(result: AnalysisResult, segments: tuple[Segment, ...]) -> Array:
    """Return kinetic and potential energies of segments at the samples of a result, (segments, S) in J."""
    every = result.dense("energy_kinetic") + result.dense("energy_potential")
    return np.array([every[:, list(one.links)].sum(axis=1) for one in segments])


@dataclass(frozen=True, eq=False)
class SegmentFlows:
    """Mean power over equal spans of the movement, (segments, spans) in W."""

    time: Array
    """Middle of each span, (spans,) in s."""
    out: Array
    """Power that the carrier gives."""
    into: Array
    """Power that the segment gets: `out`, and what the joints give."""


def segment_flows(result: AnalysisResult, segments: tuple[Segment, ...], spans: int) -> SegmentFlows:
    """Return the flows through the joints of segments, from all samples; zeros for those without joints."""
    start, end = float(result.time[0]), float(result.time[-1])
    sums, counts = np.zeros((2, len(segments), spans)), np.zeros(spans)
    jointed = [at for at, one in enumerate(segments) if one.joints]
    for part in result.parts() if "flow" in result.rows else ():
        span = np.minimum(((part.time - start) / (end - start) * spans).astype(int), spans - 1)
        counts += np.bincount(span, minlength=spans)
        before, flow = part.dense("flow_before"), part.dense("flow")
        for at in jointed:
            joints = segments[at].joints
            for side, values in enumerate((before[:, joints[0]], flow[:, joints[-1]])):
                sums[side, at] += np.bincount(span, values, spans)
    middle = start + (np.arange(spans) + 0.5) / spans * (end - start)
    return SegmentFlows(middle, *(sums / np.maximum(counts, 1.0)))


@dataclass(frozen=True, eq=False)
class SegmentWork:
    """Net work on segments, (segments,) in J each."""

    torques: dict[int, Array]
    """Work of the torques of each segment's joints, by its index."""
    others: dict[str, Array]
    """Work of all else, by what it is called; with that of torques it is what the energies gained."""
    out: Array
    """Work that came from the carrier, and what with the joints' own came into the segment."""
    into: Array

    @property
    def size(self) -> Array:
        """Magnitudes of all work, added up."""
        size: Array = np.sum(np.abs([*self.torques.values(), *self.others.values()]), axis=0)
        return size

    @property
    def whole(self) -> Array:
        """Gain of the segments' energies."""
        whole: Array = np.sum([*self.torques.values(), *self.others.values()], axis=0)
        return whole


def work_of_segments(result: AnalysisResult, segments: tuple[Segment, ...], phase: int) -> SegmentWork:
    """Return work over the whole movement, for 0, or over a phase, by its number from 1."""
    works = result.work_in_phases[phase - 1] if phase else result.work_by_source
    net = {name: works[name].net for name in result.work_by_source}
    out, into = np.zeros((2, len(segments)))
    for at, one in enumerate(segments):
        if one.joints:
            out[at], into[at] = net["flow_before"][one.joints[0]], net["flow"][one.joints[-1]]

    def of_segments(work: Array) -> Array:
        return np.array([work[list(one.links)].sum() for one in segments])

    torques = {
        at: of_segments(net["gain_tau"][:, list(one.joints)].sum(axis=1))
        for at, one in enumerate(segments)
        if one.joints
    }
    others = {label: of_segments(work) for label, work in _others(result, net, bool(torques)).items()}
    return SegmentWork(torques, others, out, into)


def _others(result: AnalysisResult, net: Mapping[str, Array], is_jointed: bool) -> dict[str, Array]:
    """Return the work of causes on the holders of energy, by kind: torques only where no segment has any."""
    nothing = np.zeros(len(result.robot.holders))

    def of(*names: str) -> Array:
        there = (net[name].reshape(len(nothing), -1).sum(axis=1) for name in names if name in net)
        return sum(there, nothing)

    found = {} if is_jointed else {"torques": of("gain_tau")}
    if result.robot.is_written:
        named = enumerate(result.robot.share_names)
        found |= {name: net["gain_share"][:, :, m].sum(axis=1) for m, name in named}
    else:
        found["gravity"] = of("gain_gravity")
    found[HANDED_ON] = of("gain_qd")
    found[LOST] = of(*(name.replace("acc", "gain", 1) for name in LOSSES))
    found |= {label: net["gain_load"][:, e] for e, label in enumerate(result.load_labels)}
    found["ties"] = of("gain_constraint")
    found["contacts that slip or turn"] = of("gain_contact")
    return found


def joints_label(robot: OpenedRobot, segment: Segment) -> str:
    """Return the names of a segment's joints: the first and the last of several; "residuals" for those."""
    if robot.residuals_apart.issuperset(segment.joints):
        return "residuals"
    names = [robot.figure_joints[i] for i in segment.joints]
    return names[0] if len(names) == 1 else f"{names[0]} … {names[-1]}"
