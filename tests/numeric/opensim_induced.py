"""OpenSim's own InducedAccelerations, which is set up by a file and answers in files.

It takes a foot as held, at a point or welded, while an external force acts on it, and the force away.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import opensim as osim
from fuzz.valid_robots import Row

from numeric.opensim_model import OpenSimModel

SETUP = """<OpenSimDocument Version="40000"><InducedAccelerations name="induced">
<coordinate_names>All</coordinate_names><body_names>{bodies}</body_names><force_threshold>1</force_threshold>
<report_constraint_reactions>true</report_constraint_reactions>
<ConstraintSet><objects>{held}</objects></ConstraintSet></InducedAccelerations></OpenSimDocument>"""
POINT = """<PointConstraint name="held"><isEnforced>false</isEnforced><socket_body_1>/ground</socket_body_1>
<socket_body_2>{body}</socket_body_2><location_body_1>{at}</location_body_1>
<location_body_2>{point}</location_body_2></PointConstraint>"""
WELD = """<WeldConstraint name="held"><isEnforced>false</isEnforced><socket_frame1>there</socket_frame1>
<socket_frame2>here</socket_frame2><frames><PhysicalOffsetFrame name="there">
<socket_parent>/ground</socket_parent><translation>{at}</translation><orientation>0 0 {turned}</orientation>
</PhysicalOffsetFrame><PhysicalOffsetFrame name="here"><socket_parent>{body}</socket_parent>
<translation>{point}</translation></PhysicalOffsetFrame></frames></WeldConstraint>"""
ROLL = """<RollingOnSurfaceConstraint name="held"><isEnforced>false</isEnforced>
<socket_rolling_body>{body}</socket_rolling_body><socket_surface_body>/ground</socket_surface_body>
<friction_coefficient>1e9</friction_coefficient><contact_radius>1e9</contact_radius>
</RollingOnSurfaceConstraint>"""
HEADER = "force\nversion=1\nnRows=2\nnColumns=7\ninDegrees=no\nendheader\n"


@dataclass(frozen=True)
class Foot:
    """A body that the ground holds at a point of it, or wholly."""

    body: str
    point: Row
    welded: bool
    rolls: bool = False


def induced_accelerations(model: OpenSimModel, q: Any, qd: Any, foot: Foot | None, folder: Path) -> Any:
    """Have `_induced_NAME.sto` written for coordinates, bodies and what the foot bears; return the state."""
    if foot:
        add_ground_force(model, foot, folder / "force.sto")
    state = model.state(q, qd)
    bodies = " ".join([*model.bodies, "center_of_mass"])
    held = holding(model, state, foot) if foot else ""
    (folder / "setup.xml").write_text(SETUP.format(bodies=bodies, held=held))
    analysis = osim.InducedAccelerations(str(folder / "setup.xml"))
    analysis.this.disown()  # its end would free the constraint twice
    analysis.setModel(model.model)
    analysis.setInDegrees(False)
    analysis.begin(state)
    osim.IO.SetScientific(True)
    osim.IO.SetPrecision(16)
    analysis.printResults("", str(folder))
    return state


def add_ground_force(model: OpenSimModel, foot: Foot, path: Path) -> None:
    """The force that a constraint takes the place of; how large it is says only that the foot is down."""
    rows = [[time, 0.0, 500.0, 0.0, *foot.point] for time in (0.0, 1.0)]
    labels = ["time", "fx", "fy", "fz", "px", "py", "pz"]
    path.write_text(HEADER + "\n".join("\t".join(map(str, row)) for row in [labels, *rows]) + "\n")
    model.log = osim.Storage(str(path))  # the force has no copy of it
    force = osim.ExternalForce(model.log, "f", "p", "", foot.body, "ground", foot.body)
    model.model.addForce(force)


def holding(model: OpenSimModel, state: Any, foot: Foot) -> str:
    """The constraint that it is, where the foot stands."""
    body = model.body(foot.body)
    stands = body.findStationLocationInGround(state, osim.Vec3(*foot.point))
    turned = body.getRotationInGround(state).convertRotationToBodyFixedXYZ().get(2)
    at, point = (" ".join(map(repr, place)) for place in (map(stands.get, range(3)), foot.point))
    if foot.rolls:
        return ROLL.format(body=model.path(foot.body))
    if not foot.welded:
        return POINT.format(body=model.path(foot.body), at=at, point=point)
    return WELD.format(body=model.path(foot.body), at=at, point=point, turned=turned)


def by_source(path: Path, *ends: str) -> dict[str, Any]:
    """The first row of a storage by source, whose columns say at their ends what they are."""
    labels, row, *_ = path.read_text().partition("endheader\n")[2].splitlines()
    values = dict(zip(labels.split(), map(float, row.split()), strict=True))
    sources = [label.removesuffix(ends[0]) for label in values if label != "time" and label.endswith(ends[0])]
    return {source: np.array([values[source + end] for end in ends]) for source in sources}
