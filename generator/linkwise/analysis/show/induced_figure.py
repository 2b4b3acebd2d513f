"""Panels of the acceleration of a point, or of the joints, and the shares of their causes.

Each joint's torque and each load have a curve of their own, all else one by its kind.
"""

from collections.abc import Sequence

from linkwise.analysis.induced_points import CENTRE, JOINTS
from linkwise.analysis.result import AnalysisResult
from linkwise.analysis.result_quantities import INDUCED, LOSSES
from linkwise.analysis.show.sourced_panels import Kind, SourceCurve, SourcedPanels, largest_alone
from linkwise.escape import column_part

MOST = 8
"""Joints whose torques have curves of their own; all other torques are summed in one."""
NOTHING = 1e-9
"""Part of the largest component below which a component is only rounding."""
MOTION = ("acc_qd", "acc_velocity", "acc_constraint", "acc_kinematic")
TITLES = {JOINTS: "the joints", CENTRE: "the centre of mass"}


def induced_panels(result: AnalysisResult, point: int, angular: bool = False) -> SourcedPanels:
    """Return a panel for each component of a point's acceleration, of which sources are shares.

    angular: include the components of a frame's rotation
    """
    shown = _components(result, point, angular)
    name = result.induced[point]
    title = f"What accelerates {TITLES.get(name, name)}"
    return SourcedPanels(title, list(shown.values()), _sources(result, point, list(shown)))


def _components(result: AnalysisResult, point: int, angular: bool) -> dict[int, tuple[str, str]]:
    """Return the name and unit of a point's components that any source accelerates, by row.

    In a planar robot nothing accelerates across its plane.
    """
    here, every = result.rows.points[point], result.rows.axes["component"].names
    names = {
        every.index(row): (column_part(row), unit)
        for row, unit in zip(here.rows, here.units, strict=True)
        if angular or "angular_" not in row
    }
    sizes = {
        at: result.totals.mean[result.rows.numbers(*INDUCED, point=point, component=at)].sum() for at in names
    }
    most = max(sizes.values(), default=0.0)
    moving = [at for at, size in sizes.items() if size > NOTHING * most]
    return {at: names[at] for at in moving or list(names)[:1]}


def _sources(result: AnalysisResult, point: int, components: Sequence[int]) -> list[SourceCurve]:
    every, names = result.robot.driven, result.robot.figure_joints

    def source(
        kind: Kind, label: str, *quantities: str, number: int = 0, **where: int | Sequence[int]
    ) -> SourceCurve:
        rows = (result.rows.numbers(*quantities, point=point, component=at, **where) for at in components)
        return SourceCurve(kind, label, number, tuple(rows))

    torques = [
        source("joint", f"torque of {names[i]}", "acc_tau", number=at, cause=i) for at, i in enumerate(every)
    ]
    alone, rest = largest_alone(result, torques, MOST)  # contacts may leave no torque to a base
    found = [source("sum", "all together", "acc"), *(torques[at] for at in alone)]
    if rest:
        others = [every[at] for at in rest]
        found.append(source("others", f"torques of {len(rest)} others", "acc_tau", cause=others))
    if result.robot.is_written:
        named = enumerate(result.robot.share_names)
        found += [source("named", name, "acc_share", number=m, share=m) for m, name in named]
    else:
        found.append(source("named", "gravity", "acc_gravity", "acc_weight"))
    found.append(source("velocity", "velocities", *MOTION))
    if any(name in result.rows for name in LOSSES):
        found.append(source("passive", "springs and losses", *LOSSES))
    for e, label in enumerate(result.load_labels):
        found.append(source("load", label, "acc_load", number=e, load=e))
    if result.robot.contacts is not None:
        found.append(source("contact", "contacts that slip or turn", "acc_contact"))
    return found
