"""Functions of an OpenSim model as curves."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from xml.etree.ElementTree import Element

import numpy as np

from linkwise.errors import LinkwiseError
from linkwise.robot.curve import Curve
from linkwise.robot.readers.osim.document import numbers_of

IDENTITY = Curve.straight(0.0, 1.0)
LINEAR = "LinearFunction"


def function_of(owner: Element, tag: str, place: str) -> Curve | None:
    """Return the function of an element, None for none; raises LinkwiseError for one that is not modelled."""
    written = written_function(owner, tag)
    return None if written is None else _known(written, place)


def written_function(owner: Element, tag: str) -> Element | None:
    """Return the element of a function that another element has; None for none.

    It is a child of its own, with or without the name `tag`, or stands in a child of that name; no other
    child of an element with functions holds elements.
    """
    for child in owner:
        if child.tag == tag and len(child):
            return child[0]
        if len(child) or child.get("name") == tag:
            return child
    return None


def _known(element: Element, place: str) -> Curve:
    reader = FUNCTIONS.get(element.tag)
    if reader is None:
        raise LinkwiseError(
            f"{place} is a {element.tag}, a function that is not modelled; make it one of "
            f"{', '.join(FUNCTIONS)}"
        )
    return reader(element, place)


def _constant(element: Element, place: str) -> Curve:
    return Curve.straight(*numbers_of(element, "value", "0", place, 1))


def _linear(element: Element, place: str) -> Curve:
    slope, value = numbers_of(element, "coefficients", "1 0", place, 2)
    return Curve((0.0,), ((value, slope),))


def _polynomial(element: Element, place: str) -> Curve:
    """Return a polynomial; its coefficients stand in the file with the highest power first."""
    return Curve((0.0,), (numbers_of(element, "coefficients", "0", place)[::-1],))


def _multiplied(element: Element, place: str) -> Curve:
    inner = function_of(element, "function", place)
    if inner is None:
        raise LinkwiseError(f"{place}: its <MultiplierFunction> multiplies no function; give it one")
    return inner.scaled(*numbers_of(element, "scale", "1", place, 1))


def _through_points(
    make: Callable[[Sequence[float], Sequence[float]], Curve],
) -> Callable[[Element, str], Curve]:
    def read(element: Element, place: str) -> Curve:
        x, y = (numbers_of(element, tag, "", place) for tag in "xy")
        if len(x) != len(y) or len(x) < 2 or any(a >= b for a, b in pairwise(x)):
            raise LinkwiseError(
                f"{place}: its <{element.tag}> needs as many <y> as <x>, two or more, and <x> that ascend"
            )
        return make(x, y)

    return read


def piecewise_linear(x: Sequence[float], y: Sequence[float]) -> Curve:
    """Return straight lines between points, continued beyond the ends."""
    slopes = [(d - b) / (c - a) for (a, b), (c, d) in pairwise(zip(x, y, strict=True))]
    return Curve(tuple(x[:-1]), tuple(zip(y, slopes, strict=False)))


def simm_spline(x: Sequence[float], y: Sequence[float]) -> Curve:
    """Return SIMM's cubic spline, with straight lines beyond its ends.

    Its third derivative at an end is that of the cubic through the four points there (G. Forsythe,
    M. Malcolm, C. Moler, Computer Methods for Mathematical Computations, 1977, ch. 4); with three points, 0.
    """
    if len(x) == 2:
        return piecewise_linear(x, y)
    h, rise = np.diff(x), np.diff(y) / np.diff(x)
    # Of each point's s = y'' / 6: h s + 2 (h + h') s' + h' s'' is the change of the slope.
    system, known = np.zeros((len(x), len(x))), np.zeros(len(x))
    for at in range(1, len(x) - 1):
        system[at, at - 1 : at + 2] = h[at - 1], 2 * (h[at - 1] + h[at]), h[at]
        known[at] = rise[at] - rise[at - 1]
    for end, inner, sign, points in ((0, 1, 1, slice(None, 4)), (-1, -2, -1, slice(-4, None))):
        system[end, end], system[end, inner] = -sign, sign
        if len(x) > 3:
            known[end] = h[end] * _third_difference(x[points], y[points])
    s = np.linalg.solve(system, known)
    slopes = rise - h * (s[1:] + 2 * s[:-1])
    last = rise[-1] + h[-1] * (s[-2] + 2 * s[-1])
    cubics = zip(y[:-1], slopes, 3 * s[:-1], np.diff(s) / h, strict=True)
    pieces = ((y[0], slopes[0]), *cubics, (y[-1], last))
    return Curve((x[0], *x), tuple(tuple(map(float, piece)) for piece in pieces))


def _third_difference(x: Sequence[float], y: Sequence[float]) -> float:
    """Return the divided difference of four points: a sixth of the third derivative of their cubic."""
    differences = list(y)
    for order in range(1, 4):
        differences = [
            (after - before) / (x[at + order] - x[at])
            for at, (before, after) in enumerate(pairwise(differences))
        ]
    return differences[0]


FUNCTIONS: dict[str, Callable[[Element, str], Curve]] = {
    "Constant": _constant,
    LINEAR: _linear,
    "PolynomialFunction": _polynomial,
    "PiecewiseLinearFunction": _through_points(piecewise_linear),
    "SimmSpline": _through_points(simm_spline),
    "NaturalCubicSpline": _through_points(simm_spline),
    "natCubicSpline": _through_points(simm_spline),
    "MultiplierFunction": _multiplied,
}
"""Readers of OpenSim's functions of one variable; natural splines are old names of the SimmSpline."""
