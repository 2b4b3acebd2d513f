"""Storage files of induced accelerations: a file a coordinate or body, a column a source.

Files and columns have the names that OpenSim's InducedAccelerations gives them. Its muscles and actuators are
the torques of joints here, by the names of the coordinates. What it counts as velocity is all that velocities
do: velocity forces, ties that turn, and J̇ q̇ of the point. What contacts do themselves has columns of its own
here, as a motion that was measured slips.
"""

from collections.abc import Iterator, Mapping, Sequence

from linkwise.analysis.induced_points import JOINTS, InducedPoint
from linkwise.analysis.opensim.storage_file import StorageFile
from linkwise.analysis.result_quantities import LOSSES
from linkwise.analysis.result_rows import ResultRows
from linkwise.errors import LinkwiseError

CENTRE = "center_of_mass"
"""Name that OpenSim gives to the centre of mass."""
TOTAL, GRAVITY, VELOCITY = "total", "gravity", "velocity"
SUMMED = ("acc", "acc_gravity", "acc_weight")
"""Quantities that have one column each, whatever link or joint they are of."""
OF_VELOCITY = ("acc_velocity", "acc_qd", "acc_kinematic", "acc_constraint")
ENDS = {
    "x": "_X",
    "y": "_Y",
    "z": "_Z",
    "angular_x": "_Ox",
    "angular_y": "_Oy",
    "angular_z": "_Oz",
}
"""Ends of column names by component of a point, in OpenSim's order."""
TEXT = """
This file contains accelerations of coordinates or bodies.

Units are S.I. units (seconds, meters, Newtons, ...)
If the header above contains a line with 'inDegrees', this indicates whether rotational values are in degrees (yes) or radians (no).

"""  # noqa: E501, as OpenSim writes it


def induced_files(rows: ResultRows) -> Iterator[StorageFile]:
    """Yield the files of a result's rows: of each coordinate, each body, the centre of mass."""
    for number, point in enumerate(rows.points):
        sources = [_sources(rows, number, row) for row in point.rows]
        if point.name == JOINTS and point.frame is None:
            for joint, found, unit in zip(point.rows, sources, point.units, strict=True):
                turns = (unit.startswith("rad"),) * len(found)
                yield StorageFile(joint, joint, tuple(found), tuple(map(tuple, found.values())), turns, TEXT)
        else:
            yield _of_point(point, dict(zip(point.rows, sources, strict=True)))


def _of_point(point: InducedPoint, sources: Mapping[str, dict[str, list[int]]]) -> StorageFile:
    ends = [row for row in ENDS if row in sources]
    every = [(source, row) for source in sources[ends[0]] for row in ends]
    return StorageFile(
        point.frame or CENTRE,
        point.frame or CENTRE,
        tuple(f"{source}{ENDS[row]}" for source, row in every),
        tuple(tuple(sources[row][source]) for source, row in every),
        tuple(row.startswith("angular") for _, row in every),
        TEXT,
    )


def _sources(rows: ResultRows, point: int, component: str) -> dict[str, list[int]]:
    """Return the rows of each source of a component's acceleration, in OpenSim's order."""
    found: dict[str, list[int]] = {TOTAL: []}
    owners: dict[str, tuple[object, ...]] = {}
    own = rows.axes["component"].names.index(component)
    for row, (quantity, at) in enumerate(rows.places):
        if quantity.startswith("acc") and at[:2] == (point, own):
            name = _source(rows, quantity, at[2:])
            owner = (name,) if quantity in (*SUMMED, *OF_VELOCITY) else (quantity, *at[2:])
            if owners.setdefault(name, owner) != owner:
                raise LinkwiseError(
                    f"--sto: two sources of accelerations would be called {name!r} there; name the"
                    " joint, load or contact otherwise"
                )
            found.setdefault(name, []).append(row)
    last = [source for source in (GRAVITY, VELOCITY) if source in found]
    contacts = [source for source in found if source.startswith("contact_")]
    first = [source for source in found if source not in (*last, *contacts)]
    return {source: found[source] for source in (*first, *last, *contacts)}


def _source(rows: ResultRows, quantity: str, at: Sequence[int]) -> str:
    """Return the name of a source: of joints as they are called, of what OpenSim lacks with its kind."""
    if quantity in OF_VELOCITY:
        return VELOCITY
    match quantity:
        case "acc":
            return TOTAL
        case "acc_gravity" | "acc_weight":
            return GRAVITY
        case "acc_tau":
            found = rows.axes["joint"].names[at[0]]
        case "acc_share":
            found = rows.axes["share"].names[at[1]]
        case "acc_contact":
            found = f"contact_{rows.axes['contact'].names[at[0]]}"
        case "acc_load":
            found = f"load_{rows.axes['load'].names[at[0]]}"
        case _:
            assert quantity in LOSSES
            found = f"{quantity.removeprefix('acc_')}_{rows.axes['joint'].names[at[0]]}"
    return "_".join(found.split())  # blanks part columns
