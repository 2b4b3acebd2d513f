"""What the page shows, as JSON that is safe inside a script element."""

import base64
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from linkwise.analysis.palette import COLOURS, GRAVITY, ON_DARK
from linkwise.analysis.poses import poses
from linkwise.analysis.result import Analysis
from linkwise.analysis.summary import provenance

Array = NDArray[np.float64]


def page_data(analysis: Analysis) -> str:
    """JSON with numbers as base64 of little-endian float64: the table's, to the last bit.

    No `<` stands in it: a name such as `</script>` cannot end the element it is embedded in.
    """
    robot = analysis.robot
    data = {
        "robot": robot.name,
        "log": analysis.source,
        "provenance": provenance(analysis),
        "rate": analysis.rate,
        "samples": len(analysis.time),
        "total": analysis.total,
        "stride": analysis.stride,
        "convention": analysis.processing.convention,
        "joints": [{"name": n, "unit": u} for n, u in zip(robot.joints, robot.units, strict=True)],
        "links": list(robot.links),
        "columns": [
            {
                "quantity": c.quantity,
                "name": c.name,
                "unit": c.unit,
                "i": c.joint,
                "j": c.link,
                "k": c.cause,
            }
            for c in analysis.columns
        ],
        "values": _encode(analysis.values),
        "mean": analysis.totals.mean.tolist(),
        "peak": analysis.totals.peak.tolist(),
        "colours": list(COLOURS),
        "coloursDark": list(ON_DARK),
        "gravityColour": GRAVITY,
        "bodies": _bodies(analysis),
    }
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _bodies(analysis: Analysis) -> dict[str, Any] | None:
    """Poses at every sample shown: origins and centres of mass, (samples, bodies, 3) each."""
    bodies = analysis.robot.bodies
    if not bodies:
        return None
    origins, centres = poses(bodies, analysis.q)
    return {
        "parents": [-1 if body.parent is None else body.parent for body in bodies],
        "links": [body.link for body in bodies],
        "coordinates": [body.coordinate for body in bodies],
        "up": list(analysis.robot.up),
        "origins": _encode(origins),
        "centres": _encode(centres),
    }


def _encode(values: Array) -> str:
    return base64.b64encode(np.ascontiguousarray(values, "<f8").tobytes()).decode("ascii")
