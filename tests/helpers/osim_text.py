"""OpenSim models for tests, as text: chains of bodies by joints of every kind."""

from collections.abc import Iterable, Mapping, Sequence
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

    def text(self, prefix: str, old: bool) -> str:
        axes = "".join(
            f'<TransformAxis name="{name}"><axis>{direction}</axis>'
            f"<coordinates>{prefix if coordinate else ''}{coordinate}</coordinates>"
            f"{f'<function>{function}</function>' if old else function.replace('>', NAMED, 1)}"
            "</TransformAxis>"
            for name, (direction, coordinate, function) in self.axes.items()
        )
        return f"<SpatialTransform>{axes}</SpatialTransform>"


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


@dataclass(frozen=True)
class _Link:
    """A body, and the joint between it and the one before, at odd places in both."""

    number: int
    kind: Kind
    mass: float
    com: Sequence[float]
    moments: Sequence[float]
    ends: Sequence[tuple[Sequence[float], Sequence[float]]]
    more: Mapping[str, str]
    turned: bool
    """True if the joint leads from the body back."""

    @property
    def tag(self) -> str:
        return "CustomJoint" if isinstance(self.kind, Custom) else self.kind

    def transform(self, old: bool) -> str:
        return self.kind.text(f"joint{self.number}_", old) if isinstance(self.kind, Custom) else ""

    @property
    def coordinates(self) -> str:
        names = self.kind.coordinates if isinstance(self.kind, Custom) else KINDS[self.kind]
        full = [f"joint{self.number}_{name}" for name in names]
        return "".join(f'<Coordinate name="{name}">{self.more.get(name, "")}</Coordinate>' for name in full)

    @property
    def body(self) -> str:
        return (
            f'<Body name="body{self.number}"><mass>{self.mass}</mass>'
            f"<mass_center>{row(self.com)}</mass_center><inertia>{row(self.moments)}</inertia></Body>"
        )

    @property
    def joint(self) -> str:
        before = f"/bodyset/body{self.number - 1}" if self.number else "/ground"
        frames = "".join(
            f'<PhysicalOffsetFrame name="{end}{self.number}"><socket_parent>{carrier}</socket_parent>'
            f"<translation>{row(place)}</translation><orientation>{row(turn)}</orientation></PhysicalOffsetFrame>"
            for end, carrier, (place, turn) in zip(
                ("parent", "child"), (before, f"/bodyset/body{self.number}"), self.ends, strict=True
            )
        )
        parent, child = ("child", "parent") if self.turned else ("parent", "child")
        return (
            f'<{self.tag} name="joint{self.number}">'
            f"<socket_parent_frame>{parent}{self.number}</socket_parent_frame>"
            f"<socket_child_frame>{child}{self.number}</socket_child_frame>"
            f"<coordinates>{self.coordinates}</coordinates><frames>{frames}</frames>"
            f"{self.transform(False)}</{self.tag}>"
        )

    @property
    def old_body(self) -> str:
        """Body and joint of format 3."""
        names = ("xx", "yy", "zz", "xy", "xz", "yz")
        moments = "".join(f"<inertia_{n}>{m}</inertia_{n}>" for n, m in zip(names, self.moments, strict=True))
        (start, turn), (place, own) = self.ends
        return (
            f'<Body name="body{self.number}"><mass>{self.mass}</mass>'
            f"<mass_center>{row(self.com)}</mass_center>{moments}"
            f'<Joint><{self.tag} name="joint{self.number}">'
            f"<parent_body>{f'body{self.number - 1}' if self.number else 'ground'}</parent_body>"
            f"<location_in_parent>{row(start)}</location_in_parent>"
            f"<orientation_in_parent>{row(turn)}</orientation_in_parent>"
            f"<location>{row(place)}</location><orientation>{row(own)}</orientation>"
            f"<reverse>{str(self.turned).lower()}</reverse>"
            f"<CoordinateSet><objects>{self.coordinates}</objects></CoordinateSet>{self.transform(True)}"
            f"</{self.tag}></Joint></Body>"
        )


def chain(
    kinds: Sequence[Kind],
    sets: str = "",
    coordinates: Mapping[str, str] | None = None,
    old: bool = False,
    turned: Sequence[int] = (),
) -> str:
    """A model of bodies one behind the other by these joints, whose frames stand askew in both bodies.

    sets: more of the model; coordinates: more of each coordinate, by its name; old: in format 3;
    turned: joints, from 0, that lead from the later body to the earlier one
    """
    draw = np.random.default_rng(len(kinds))
    links = []
    for number, kind in enumerate(kinds):
        half = draw.normal(size=(3, 3))
        spread = half @ half.T
        inertia = np.trace(spread) * np.eye(3) - spread
        moments = [float(inertia[i, k]) for i, k in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        mass, com = float(draw.uniform(1, 3)), draw.normal(size=3).tolist()
        ends = [(draw.normal(size=3).tolist(), draw.normal(size=3).tolist()) for _ in range(2)]
        links.append(_Link(number, kind, mass, com, moments, ends, coordinates or {}, number in turned))
    bodies = "".join(link.old_body if old else link.body for link in links)
    joints = "" if old else f"<JointSet><objects>{''.join(link.joint for link in links)}</objects></JointSet>"
    return model(f"<BodySet><objects>{bodies}</objects></BodySet>{joints}{sets}", "30000" if old else "40500")


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
