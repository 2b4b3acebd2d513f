"""Columns of a result that were asked for: by presets, and by patterns of their names."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from linkwise.analysis.column_patterns import fitting, matching
from linkwise.analysis.loads.placed import PlacedLoad
from linkwise.analysis.net_causes import NET, net_causes, net_places
from linkwise.analysis.opened_robot import OpenedRobot
from linkwise.analysis.result_quantities import FORCES, PASSIVE, POWER_TERMS, TERMS, TORQUE_OF
from linkwise.analysis.result_rows import DEVIATION, OF_MOTION, Place, ResultRows
from linkwise.arrays import Index

ALWAYS = ("time", "q", "qd", "qdd", "contact", "slip")
"""Quantities that every result has: its motion, and what contacts do."""
SUMS = (*ALWAYS, "tau", "tau_before_muscles", "power", "force", "force_measured", "tau_as_loads")
"""Quantities of joints, and of rows of constraints, without what these are the sum of."""
CAUSES = (*SUMS, *TERMS, *PASSIVE, "tau_load", *FORCES)
"""These, and torques and forces by cause: without sums by link, and without powers by link."""
CHOOSABLE = (*CAUSES, "tau_link", *TORQUE_OF, "power_contact")
"""Quantities among which is chosen; what another option asks for is told whatever is chosen, and net torques
by cause are told where they are asked for alone."""
BY_CAUSE = (*SUMS, NET)
"""Sums, and net torques by cause, without what goes through each link."""
PRESETS = {"all": CHOOSABLE, "sums": SUMS, "by-cause": BY_CAUSE, "causes": CAUSES}
FLAG = f"--columns, which takes {', '.join(PRESETS)}, or columns,"


def chosen_rows(rows: ResultRows, asked: Sequence[str], power_terms: bool) -> Index:
    """Return the numbers of the rows that presets and patterns choose, ascending; all where none are given.

    A power comes with the torque that it is made of, a net torque with that of the joint, a deviation with
    what it is of, and this with it.
    power_terms: whether powers by cause and order are asked for otherwise

    Raises LinkwiseError for a pattern that fits no column.
    """
    if not asked:
        return np.arange(len(rows))
    fits = fitting(FLAG, [column.name for column in rows.columns], _patterns(asked))
    return _rows_of(rows, asked, power_terms, set(fits))


def computed_rows(rows: ResultRows, asked: Sequence[str], power_terms: bool) -> Index:
    """Return the numbers of the rows of torques that `chosen_rows` needs of these, which others come beside.

    A pattern may fit columns of these others alone.
    """
    if not asked:
        return np.arange(len(rows))
    names = [column.name for column in rows.columns]
    fits = [matching(names, one.removeprefix(DEVIATION)) for one in _patterns(asked)]
    return _rows_of(rows, asked, power_terms, set().union(*fits))


class ChosenPlaces(NamedTuple):
    """Places of torques that are computed."""

    torques: Sequence[Place]
    nets: Sequence[Place]
    """Net torques by cause that are computed too."""
    every_net: Sequence[Place]
    left_out: frozenset[str]
    """Quantities of which places are left out."""


def chosen_places(
    robot: OpenedRobot,
    every: Sequence[Place],
    loads: Sequence[PlacedLoad],
    computed: Sequence[str],
    asked: Sequence[str],
    power_terms: bool,
) -> ChosenPlaces:
    """Return which of all places of torques are computed, and of net torques by cause.

    computed, asked: presets and patterns of torques and of net torques; the latter are none unless asked for
    """
    every_net = net_places(net_causes(robot, len(loads)), every)
    rows = computed_rows(ResultRows.of(robot, every, loads), computed, power_terms)
    nets = _nets(ResultRows.of(robot, every_net, loads), asked, len(rows) == len(every))
    kept = {*(every[row] for row in rows.tolist()), *(("tau", at[:1]) for _, at in nets)}
    left_out = frozenset(name for name, at in every if (name, at) not in kept)
    left_out |= {NET} if 0 < len(nets) < len(every_net) else set()
    return ChosenPlaces([place for place in every if place in kept], nets, every_net, left_out)


def _nets(rows: ResultRows, asked: Sequence[str], is_whole: bool) -> list[Place]:
    """Return the places of net torques that are asked for; all if any is and all torques are computed."""
    names = [column.name for column in rows.columns]
    fits = set().union(*(matching(names, one.removeprefix(DEVIATION)) for one in _patterns(asked)))
    if any(NET in PRESETS.get(one, ()) for one in asked) or (is_whole and fits):
        return list(rows.places)
    return [place for place, name in zip(rows.places, names, strict=True) if name in fits]


def _patterns(asked: Sequence[str]) -> list[str]:
    return [one for one in asked if one not in PRESETS]


def _rows_of(rows: ResultRows, asked: Sequence[str], power_terms: bool, fits: set[str]) -> Index:
    quantities = {name for preset in asked for name in PRESETS.get(preset, ())}
    quantities |= {*ALWAYS, *(POWER_TERMS if power_terms else ())}
    places = [(name.removeprefix(DEVIATION).removeprefix(OF_MOTION), at) for name, at in rows.places]
    kept = {
        place
        for column, place in zip(rows.columns, places, strict=True)
        if place[0] in quantities or (place[0] in (*CHOOSABLE, NET) and column.name in fits)
    }
    kept |= {(TORQUE_OF[name], at) for name, at in kept if name in TORQUE_OF}
    kept |= {("tau", at[:1]) for name, at in kept if name == NET}
    numbers = [k for k, place in enumerate(places) if place[0] not in (*CHOOSABLE, NET) or place in kept]
    return np.array(numbers, np.intp)
