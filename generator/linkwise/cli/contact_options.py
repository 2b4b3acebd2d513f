"""The flags of contacts: which frames the ground holds, how, and when."""

from pathlib import Path
from typing import Annotated

import typer

Held = Annotated[
    list[str] | None,
    typer.Option(
        "--contact",
        metavar="FRAME=KIND@X,Y,Z",
        help="Frame that the ground holds, at a point in its axes, m; KIND is held, point, hinged,AX,AY,AZ"
        " about an axis, or rolling,RADIUS; NAME:FRAME=… names it; may be repeated",
    ),
]
While = Annotated[
    list[str] | None,
    typer.Option(
        "--contact-while",
        metavar="NAME=COLUMN>VALUE",
        help="The contact is on while a column of the log is above a value, 0.5 if not given; may be"
        " repeated",
    ),
]
Measured = Annotated[
    list[Path] | None,
    typer.Option(
        "--contact-loads",
        metavar="FILE",
        help="Loads measured at the contacts, read as --loads are: each contact is on while they come to"
        " more than --contact-threshold, and they load nothing; may be repeated",
    ),
]
Threshold = Annotated[float | None, typer.Option("--contact-threshold", help="Force in N; 20 if not given")]
Unactuated = Annotated[
    list[str] | None,
    typer.Option(
        "--unactuated",
        metavar="JOINT",
        help="Joint that nothing drives, by whose equation reactions are found; the floating base's if not"
        " given; may be repeated",
    ),
]
