"""A leg that walks on a plate, as OpenSim's files: model, motion, loads, and a setup of its AnalyzeTool."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from helpers.osim_text import KNEE, LINEAR, Custom, chain

BASE = Custom(
    ("tilt", "list", "turn", "tx", "ty", "tz"),
    {
        f"{what}{n}": (axis, name, LINEAR)
        for what, names in (("rotation", ("tilt", "list", "turn")), ("translation", ("tx", "ty", "tz")))
        for n, (axis, name) in enumerate(zip(("0 0 1", "1 0 0", "0 1 0"), names, strict=True), 1)
    },
)
"""The six coordinates of a pelvis as models of gait have them; those of a FreeJoint have other speeds."""
KINDS = {"hip": "PinJoint", "knee": KNEE, "ankle": "UniversalJoint"}
MODEL = chain([BASE, *KINDS.values()]).replace("0.3 -9.7 0.5", "0 -9.7 0")
COORDINATES = (
    *(f"joint0_{name}" for name in BASE.coordinates),
    *("joint1_angle", "joint2_angle", "joint3_first", "joint3_second"),
)
BODIES = tuple(f"body{number}" for number in range(4))
RATE, SAMPLES = 100.0, 151
CENTRE_OF_PRESSURE = ((-0.05, 0.12), (-0.02, 0.01), (0.01, 0.0))
"""Where the plate is pressed, in the ground, x, y and z in m: at 0 s, and the way in a second."""
SETUP = """<OpenSimDocument Version="40600"><AnalyzeTool name="walk">
<model_file>leg.osim</model_file><results_directory>results</results_directory>
<initial_time>0.2</initial_time><final_time>1.2</final_time>
<AnalysisSet name="Analyses"><objects><InducedAccelerations name="InducedAccelerations">
<on>true</on><start_time>-Inf</start_time><end_time>Inf</end_time><step_interval>1</step_interval>
<in_degrees>false</in_degrees><coordinate_names>All</coordinate_names>
<body_names>{bodies} center_of_mass</body_names>
<ConstraintSet><objects>{constraints}</objects><groups/></ConstraintSet>
<force_threshold>20</force_threshold><compute_potentials_only>false</compute_potentials_only>
<report_constraint_reactions>false</report_constraint_reactions>
</InducedAccelerations></objects><groups/></AnalysisSet>
<external_loads_file>{loads}</external_loads_file><states_file/><coordinates_file>walk.sto</coordinates_file>
<lowpass_cutoff_frequency_for_coordinates>6</lowpass_cutoff_frequency_for_coordinates>
</AnalyzeTool></OpenSimDocument>"""
LOADS = """<OpenSimDocument Version="40000"><ExternalLoads name="plates"><objects><ExternalForce name="plate">
<applied_to_body>body3</applied_to_body><force_identifier>f</force_identifier>
<point_identifier>p</point_identifier></ExternalForce></objects><datafile>plate.sto</datafile>
</ExternalLoads></OpenSimDocument>"""


def write_storage(path: Path, table: np.ndarray, names: Sequence[str]) -> None:
    """Write a table (S, 1 + names) of time and values in radians, m and N that reads back exactly."""
    facts = f"nRows={len(table)}\nnColumns={table.shape[1]}\ninDegrees=no\nendheader"
    rows = ["\t".join(map(repr, row)) for row in table.tolist()]
    path.write_text("\n".join([path.stem, "version=1", facts, "\t".join(["time", *names]), *rows]) + "\n")


def motion(samples: int) -> np.ndarray:
    """Return time and coordinates (S, 1 + 10) of a movement in s, rad and m."""
    time, number = np.arange(samples) / RATE, np.arange(len(COORDINATES))
    q = 0.2 * np.sin(2 * np.pi * time[:, None] * (0.3 + 0.07 * number) + number)
    return np.column_stack([time, q])


def write_case(folder: Path, constraints: str = "", loads: str = "", bodies: str = "All") -> Path:
    """Write all files into a folder; return the setup. The foot moves somewhat, as a measured one does."""
    (folder / "leg.osim").write_text(MODEL)
    walk = motion(SAMPLES)
    time = walk[:, 0]
    write_storage(folder / "walk.sto", walk, COORDINATES)
    start, way = np.array(CENTRE_OF_PRESSURE).T
    force = np.tile([10.0, 600.0, -5.0], (SAMPLES, 1))
    plate = np.column_stack([time, force, start + way * time[:, None]])
    write_storage(folder / "plate.sto", plate, [f"{part}{axis}" for part in "fp" for axis in "xyz"])
    (folder / "plate.xml").write_text(LOADS)
    setup = folder / "setup.xml"
    setup.write_text(SETUP.format(constraints=constraints, loads=loads, bodies=bodies))
    return setup


def read_storage(path: Path) -> dict[str, np.ndarray]:
    """Return the columns of a storage file by name."""
    names, *rows = path.read_text().partition("endheader\n")[2].splitlines()
    table = np.array([row.split("\t") for row in rows], dtype=float)
    return dict(zip(names.split("\t"), table.T, strict=True))
