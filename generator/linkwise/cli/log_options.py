"""The flags that read a log of motion and derive velocities, for every command that reads one."""

from pathlib import Path
from typing import Annotated

import typer
from linkwise_runtime.file_joints import Order

from linkwise.analysis.settings import Derivative, Edges, Padding, Units

UNITS = {
    "reading": "B",
    "resampling": "samples",
    "closing": "samples",
    "analysing": "samples",
    "fitting": "samples",
}
"""Units in which progress is counted, by stage."""

Log = Annotated[
    Path,
    typer.Argument(help="Motion log: .csv, .mot, .sto, .parquet, .npz, HDF5, or a bag of ROS"),
]
AngleUnits = Annotated[
    Units | None,
    typer.Option(help="Unit of the angles, lengths are metres; the file's own, else rad, if not given"),
]
Time = Annotated[str | None, typer.Option(help="Column of the time, in s")]
Topic = Annotated[
    str | None,
    typer.Option(help="Topic of a bag, group of an HDF5 file: where the joints are, if several have some"),
]
Positions = Annotated[
    Order | None,
    typer.Option("--qpos", help="Take the array of positions, and of torques, as this simulator has them"),
]
Map = Annotated[
    list[str] | None,
    typer.Option("--map", metavar="COLUMN=JOINT", help="Column of a joint; may be repeated"),
]
IgnoreExtra = Annotated[bool, typer.Option("--ignore-extra", help="Leave out columns no joint has")]
Resample = Annotated[float | None, typer.Option(help="Bring uneven time to this rate, Hz, by splines")]
LoopTolerance = Annotated[
    float, typer.Option(help="How far the log may be from closing the robot's loops, m and rad")
]
How = Annotated[Derivative, typer.Option(help="How velocities and accelerations are made")]
Window = Annotated[int | None, typer.Option(help="Savitzky-Golay: samples a window; 11 if not given")]
Degree = Annotated[int | None, typer.Option(help="Savitzky-Golay: degree of the fit; 4 if not given")]
Cutoff = Annotated[
    float | None, typer.Option(help="Zero-phase Butterworth low-pass, Hz; no filter if not given")
]
FilterOrder = Annotated[int | None, typer.Option(help="The filter's order, of one pass; 2 if not given")]
Pad = Annotated[
    Padding | None, typer.Option(help="How the filter continues the log past its ends; odd if not given")
]
Ends = Annotated[Edges, typer.Option(help="First and last samples: one-sided formulas, or cut off")]
Backend = Annotated[str | None, typer.Option(help="Back end of the package; its fastest if not given")]
