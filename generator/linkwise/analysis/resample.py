"""Samples of uneven time brought to an even rate, window by window."""

from pathlib import Path

import numpy as np

from linkwise.analysis.extras import extra
from linkwise.analysis.log import BLOCK, Array
from linkwise.analysis.spool import Spool
from linkwise.errors import LinkwiseError
from linkwise.progress import Progress, silent

OVERLAP = 64
"""Knots seen past a window. A knot's influence on a cubic spline at least halves from one to the
next, so what is cut away is below 2⁻⁶⁴ of the signal."""

MOST = 100
"""How many times the log's own rate is still a plausible wish, and not a slip of the finger."""


def resample(
    samples: Array, rate: float, spool: Path | None, rows: int = BLOCK, progress: Progress = silent
) -> Array:
    """Cubic splines through samples (S, 1 + n), time first, at `rate` Hz from the first time on."""
    spline = extra("scipy.interpolate").CubicSpline
    time = samples[:, 0]
    own = (len(time) - 1) / (time[-1] - time[0])
    if rate > MOST * own:
        raise LinkwiseError(
            f"--resample {rate:g} Hz is more than {MOST} times the log's own mean rate of {own:.6g} Hz;"
            " lower it"
        )
    count = int(np.floor((time[-1] - time[0]) * rate * (1 + 1e-12))) + 1
    if len(samples) < 4 or count < 5:
        raise LinkwiseError(f"{len(samples)} samples give {count} at {rate:g} Hz; 5 or more are needed")
    with Spool(samples.shape[1], spool) as table:
        for start in range(0, count, rows):
            at = time[0] + np.arange(start, min(start + rows, count)) / rate
            low = max(0, int(np.searchsorted(time, at[0])) - OVERLAP)
            high = min(len(time), int(np.searchsorted(time, at[-1])) + OVERLAP)
            window = np.asarray(samples[low:high])
            values = spline(window[:, 0], window[:, 1:], axis=0)(np.minimum(at, time[-1]))
            table.append(np.column_stack([at, values]))
            progress("resampling", start + len(at), count)
        return table.finish()
