"""Choices of an analysis as written in commands and studies: numbers, names and short texts."""

from collections.abc import Sequence

from linkwise.analysis.body_names import named_body
from linkwise.analysis.loaded_robot import LoadedRobot
from linkwise.analysis.loads import Load
from linkwise.analysis.settings import Convention, Derivative, Edges, Lowpass, Padding, Payload, Processing
from linkwise.errors import LinkwiseError


def chosen_processing(
    derivative: Derivative,
    window: int | None,
    degree: int | None,
    lowpass: Lowpass | None,
    edges: Edges,
    convention: Convention = "closing",
) -> Processing:
    """Return the choices of how velocities and accelerations are derived, by the flags.

    Raises LinkwiseError for flags of another derivative.
    """
    if derivative == "five-point" and (window, degree) != (None, None):
        raise LinkwiseError("--window and --degree go with --derivative savitzky-golay; add it")
    return Processing(
        derivative,
        11 if window is None else window,
        4 if degree is None else degree,
        lowpass,
        edges,
        convention,
    )


def chosen_lowpass(cutoff: float | None, order: int | None, padding: Padding | None) -> Lowpass | None:
    """Return the filter that the flags ask for, None without a cutoff.

    Raises LinkwiseError for other flags of a filter without a cutoff.
    """
    if cutoff is not None:
        return Lowpass(cutoff, 2 if order is None else order, padding or "odd")
    if (order, padding) != (None, None):
        raise LinkwiseError("--filter-order and --padding go with --cutoff; add it")
    return None


def pairs(flag: str, given: Sequence[str]) -> tuple[tuple[str, str], ...]:
    """Return the columns and joints of a flag's COLUMN=JOINT.

    Raises LinkwiseError for text of another form.
    """
    found = []
    for text in given:
        column, sign, joint = text.rpartition("=")
        if not (sign and column and joint):
            raise LinkwiseError(f"{flag} {text}: write it as COLUMN=JOINT")
        found.append((column, joint))
    return tuple(found)


def carried(given: Sequence[str], robot: LoadedRobot) -> tuple[Payload, ...]:
    """Return the payloads of [NAME:]BODY=MASS[,x,y,z].

    Raises LinkwiseError for text of another form.
    """
    found = []
    for text in given:
        where, sign, numbers = text.rpartition("=")
        try:
            mass, *point = map(float, numbers.split(","))
        except ValueError:
            sign = ""
        if not (sign and where) or len(point) not in (0, 3):
            raise LinkwiseError(f"--payload {text}: write it as BODY=MASS,x,y,z, in kg and m")
        name, body = named_body(where, robot)
        x, y, z = point or (0.0, 0.0, 0.0)
        found.append(Payload(body, mass, (x, y, z), name))
    return tuple(found)


def constant_loads(given: Sequence[str], robot: LoadedRobot) -> tuple[Load, ...]:
    """Return the loads of [NAME:]BODY=FX,FY,FZ[,MX,MY,MZ][@X,Y,Z].

    Raises LinkwiseError for text of another form.
    """
    found = []
    for text in given:
        where, sign, numbers = text.rpartition("=")
        wrench, at, place = numbers.partition("@")
        try:
            force_and_moment = list(map(float, wrench.split(",")))
            point = list(map(float, place.split(","))) if at else [0.0, 0.0, 0.0]
        except ValueError:
            sign = ""
        if not (sign and where) or len(force_and_moment) not in (3, 6) or len(point) != 3:
            raise LinkwiseError(
                f"--load {text}: write it as BODY=FX,FY,FZ, or with moments behind them and with the point as"
                " BODY=FX,FY,FZ,MX,MY,MZ@X,Y,Z, in N, N·m and m"
            )
        name, body = named_body(where, robot)
        moment = force_and_moment[3:] or (0.0, 0.0, 0.0)
        found.append(Load(name or body, body, force_and_moment[:3], moment, point))
    return tuple(found)
