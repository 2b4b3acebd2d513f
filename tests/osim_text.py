"""OpenSim models for tests, as text: chains of bodies by joints of every kind."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

NAMED = ' name="function">'
LINEAR = "<LinearFunction><coefficients>1 0</coefficients></LinearFunction>"


def points(tag: str, *given: tuple[float, float]) -> str:
    """A function through points."""
    x, y = (" ".join(map(str, row)) for row in zip(*given, strict=True))
    return f"<{tag}><x>{x}</x><y>{y}</y></{tag}>"


def coefficients(tag: str, *given: float) -> str:
    return f"<{tag}><coefficients>{row(given)}</coefficients></{tag}>"


def constant(value: float) -> str:
    return f"<Constant><value>{value}</value></Constant>"


def multiplied(scale: float, function: str) -> str:
    return f"<MultiplierFunction><function>{function}</function><scale>{scale}</scale></MultiplierFunction>"


def row(values: Iterable[float]) -> str:
    return " ".join(map(str, values))


SLIDES = points("SimmSpline", (-2.1, -0.003), (-1.2, 0.04), (-0.3, -0.01), (0.2, -0.05), (2.1, -0.006))
ROLLS = points("SimmSpline", (-2.1, 0.3), (-0.9, -0.2), (0.1, 0.25), (1.0, 0.1), (2.1, -0.4))
LINES = points("PiecewiseLinearFunction", (-1.0, 0.2), (0.3, -0.1), (1.0, 0.4))


@dataclass(frozen=True)
class Custom:
    """Axes of a spatial transform by name: direction, coordinate (empty for none) and function."""

    coordinates: tuple[str, ...]
    axes: dict[str, tuple[str, str, str]]

    def text(self, prefix: str) -> str:
        return "".join(
            f'<TransformAxis name="{name}"><axis>{direction}</axis>'
            f"<coordinates>{prefix if coordinate else ''}{coordinate}</coordinates>"
            f"{function.replace('>', NAMED, 1)}</TransformAxis>"
            for name, (direction, coordinate, function) in self.axes.items()
        )


KNEE = Custom(
    ("angle",),
    {
        "rotation1": ("0 0 1", "angle", LINEAR),
        "rotation2": ("0 1 0", "angle", ROLLS),
        "rotation3": ("1 0 0", "", constant(0.2)),
        "translation1": ("1 0 0", "angle", SLIDES),
        "translation2": ("0.6 0.8 0", "angle", multiplied(0.3, ROLLS)),
        "translation3": ("0 0 1", "", constant(-0.05)),
    },
)
ROLLING = Custom(
    ("turn", "slip"),
    {
        "rotation1": ("1 0 0", "turn", coefficients("LinearFunction", -0.7, 0.2)),
        "rotation3": ("0.6 0 0.8", "turn", coefficients("PolynomialFunction", 0.3, -0.2, 0.1)),
        "translation1": ("1 0 0", "slip", LINEAR),
        "translation3": ("0 0 1", "slip", LINES),
    },
)
KINDS: dict[str, tuple[str, ...]] = {
    "WeldJoint": (),
    "PinJoint": ("angle",),
    "SliderJoint": ("slide",),
    "UniversalJoint": ("first", "second"),
    "GimbalJoint": ("first", "second", "third"),
    "BallJoint": ("first", "second", "third"),
    "PlanarJoint": ("turn", "x", "y"),
    "FreeJoint": ("first", "second", "third", "x", "y", "z"),
}
Kind = str | Custom


def chain(kinds: Sequence[Kind], sets: str = "", coordinate: dict[str, str] | None = None) -> str:
    """A model of bodies one behind the other by these joints, whose frames stand askew in both bodies.

    sets: more of the model; coordinate: more of a coordinate, by its name
    """
    draw = np.random.default_rng(len(kinds))
    bodies = joints = ""
    parent = "/ground"
    for number, kind in enumerate(kinds):
        half = draw.normal(size=(3, 3))
        spread = half @ half.T
        inertia = np.trace(spread) * np.eye(3) - spread
        moments = row(inertia[i, k] for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)))
        bodies += (
            f'<Body name="body{number}"><mass>{draw.uniform(1, 3)}</mass>'
            f"<mass_center>{row(draw.normal(size=3))}</mass_center><inertia>{moments}</inertia></Body>"
        )
        own, child = f"joint{number}", f"/bodyset/body{number}"
        tag, names = ("CustomJoint", kind.coordinates) if isinstance(kind, Custom) else (kind, KINDS[kind])
        frames = coordinates = ""
        for end, place in (("parent", parent), ("child", child)):
            frames += (
                f'<PhysicalOffsetFrame name="{own}_{end}"><socket_parent>{place}</socket_parent>'
                f"<translation>{row(draw.normal(size=3))}</translation>"
                f"<orientation>{row(draw.normal(size=3))}</orientation></PhysicalOffsetFrame>"
            )
        for name in names:
            full = f"{own}_{name}"
            coordinates += f'<Coordinate name="{full}">{(coordinate or {}).get(full, "")}</Coordinate>'
        transform = ""
        if isinstance(kind, Custom):
            transform = f"<SpatialTransform>{kind.text(own + '_')}</SpatialTransform>"
        joints += (
            f'<{tag} name="{own}"><socket_parent_frame>{own}_parent</socket_parent_frame>'
            f"<socket_child_frame>{own}_child</socket_child_frame><coordinates>{coordinates}</coordinates>"
            f"<frames>{frames}</frames>{transform}</{tag}>"
        )
        parent = child
    return model(
        f"<BodySet><objects>{bodies}</objects></BodySet><JointSet><objects>{joints}</objects></JointSet>{sets}"
    )


def constraints(*given: str) -> str:
    return f"<ConstraintSet><objects>{''.join(given)}</objects></ConstraintSet>"


def coupler(dependent: str, free: str, function: str, enforced: str = "true") -> str:
    return (
        f'<CoordinateCouplerConstraint name="{dependent}_follows"><isEnforced>{enforced}</isEnforced>'
        f"<coupled_coordinates_function>{function}</coupled_coordinates_function>"
        f"<independent_coordinate_names>{free}</independent_coordinate_names>"
        f"<dependent_coordinate_name>{dependent}</dependent_coordinate_name></CoordinateCouplerConstraint>"
    )


def model(content: str, version: str = "40500") -> str:
    return (
        f'<?xml version="1.0" encoding="UTF-8"?><OpenSimDocument Version="{version}"><Model name="chain">'
        f"<gravity>0.3 -9.7 0.5</gravity>{content}</Model></OpenSimDocument>"
    )
