"""The zero-phase low-pass over a log of any length, in place, and derivatives, block by block.

`scipy.signal.sosfiltfilt` needs the whole log at once. Here its two passes, forwards and backwards,
go over blocks and carry the filter's state from one to the next: memory stays flat, and the result
is sosfiltfilt's, sample for sample, for every block length.

The log is continued past its ends until the filter has forgotten how it started. SciPy's own padding, three
times the taps, is shorter: at 6 Hz and 100 Hz it gives a straight ramp of 1.3 m/s an acceleration of 4 m/s²
at its ends.

Formulas of derivatives look at `span` neighbouring samples, so a block that also sees span - 1 samples on
either side gives what the whole log would.
"""

import math

import numpy as np
from numpy.typing import NDArray

from linkwise.analysis.disk_rows import let_go
from linkwise.analysis.settings import SPLINE_DEGREE, Lowpass, Processing
from linkwise.arrays import Array
from linkwise.errors import LinkwiseError
from linkwise.extras import extra

FORGOTTEN = 1e-6
"""Fraction of a filter's initial transient that is left behind the padding."""
LONGEST_MEMORY = 1 << 16
"""Most samples that a filter remembers."""


def lowpass(q: Array, rate: float, settings: Lowpass, rows: int = 65536, flag: str = "--cutoff") -> None:
    """Filter q (samples, n) in place.

    rate: in Hz; rows: the length of a block; flag: the flag that gives the cutoff, for messages

    Raises LinkwiseError for a cutoff too low to compute, or not below half the rate, and a log too short.
    """
    sos, rest = sections_at_rest(rate, settings, flag)
    pad = padding_length(sos, len(q)) if settings.padding != "none" else 0
    front = _extension(q[: pad + 1], settings.padding)
    back = _extension(q[-1 : -pad - 2 : -1], settings.padding)[::-1]
    blocks = [(at, min(at + rows, len(q))) for at in range(0, len(q), rows)]

    state = rest * (front[0] if pad else q[0])
    _, state = _passed(sos, front, state)
    for start, stop in blocks:
        q[start:stop], state = _passed(sos, q[start:stop], state)
        let_go(q)
    back, _ = _passed(sos, back, state)

    state = rest * (back[-1] if pad else q[-1])
    _, state = _passed(sos, back[::-1], state)
    for start, stop in reversed(blocks):
        backwards, state = _passed(sos, q[start:stop][::-1], state)
        q[start:stop] = backwards[::-1]
        let_go(q)


def sections_at_rest(rate: float, settings: Lowpass, flag: str = "--cutoff") -> tuple[Array, Array]:
    """Return the filter's sections of one pass, and their states (sections, 2, 1) where all input was 1.

    rate: in Hz; flag: the flag that gives the cutoff, for messages

    Raises LinkwiseError for a cutoff too low to compute, or not below half the rate.
    """
    if settings.cutoff >= rate / 2:
        raise LinkwiseError(
            f"{flag} {settings.cutoff:g} Hz is not below half the sampling rate of {rate:g} Hz; lower it"
        )
    sos = _sections(rate, settings)
    try:
        return sos, extra("scipy.signal").sosfilt_zi(sos)[:, :, None]
    except np.linalg.LinAlgError:  # its poles round to 1
        raise LinkwiseError(
            f"{flag} {settings.cutoff:g} Hz is too low for a sampling rate of {rate:g} Hz; raise it"
        ) from None


def padding_length(sos: Array, samples: int) -> int:
    """Return the number of samples of padding, after which the filter's initial transient is gone.

    It is at most that of the log less one. Raises LinkwiseError where the log is not even longer than SciPy's
    padding, three times the taps that are not at the origin.
    """
    taps = 2 * len(sos) + 1 - min((sos[:, 2] == 0).sum(), (sos[:, 5] == 0).sum())
    least = int(3 * taps)
    if samples <= least:
        raise LinkwiseError(
            f"{samples} samples are too few for the filter's padding of {least}; lower --filter-order"
        )
    return min(max(least, _decay(sos, samples)), samples - 1)


def filter_memory(rate: float, settings: Lowpass) -> int:
    """Return the number of samples after which the filter has forgotten one, at `rate` Hz."""
    return _decay(_sections(rate, settings), LONGEST_MEMORY)


def _decay(sos: Array, otherwise: int) -> int:
    """Return the number of samples after which a transient is gone; otherwise: of one that stays."""
    slowest = max(abs(np.roots(section[3:])).max() for section in sos)
    return math.ceil(math.log(FORGOTTEN) / math.log(slowest)) if slowest < 1.0 else otherwise


def _sections(rate: float, settings: Lowpass) -> Array:
    """Return the sections of second order of one pass."""
    found: Array = extra("scipy.signal").butter(settings.order, settings.cutoff, fs=rate, output="sos")
    return found


def _passed(sos: Array, x: Array, state: Array) -> tuple[Array, Array]:
    if not len(x):
        return x, state
    with np.errstate(over="ignore", invalid="ignore"):
        y, after = extra("scipy.signal").sosfilt(sos, x, axis=0, zi=state)
    return y, after


def _extension(edge: Array, padding: str) -> Array:
    """Return the samples that continue a log before edge[0], (len(edge) - 1, n).

    "odd" turns the samples about the end, "even" mirrors them, else the end's value is held.
    """
    beyond: Array = edge[:0:-1]
    if padding == "odd":
        with np.errstate(over="ignore"):
            beyond = 2 * edge[0] - beyond
    elif padding == "even":
        beyond = beyond.copy()  # the filter works in place
    else:
        beyond = np.repeat(edge[:1], len(edge) - 1, axis=0)
    return beyond


# Five-point formulas, from Taylor's expansion: row p holds 12 times the weights of the derivative at the
# p-th of 5 samples, times the step (or its square).
FIRST = np.array(
    [
        [-25, 48, -36, 16, -3],
        [-3, -10, 18, -6, 1],
        [1, -8, 0, 8, -1],
        [-1, 6, -18, 10, 3],
        [3, -16, 36, -48, 25],
    ]
)
SECOND = np.array(
    [
        [35, -104, 114, -56, 11],
        [11, -20, 6, 4, -1],
        [-1, 16, -30, 16, -1],
        [-1, 4, 6, -20, 11],
        [11, -56, 114, -104, 35],
    ]
)


def derivatives(
    positions: Array, rate: float, start: int, stop: int, processing: Processing
) -> tuple[Array, Array, Array]:
    """Return q, q̇, q̈ of the samples start..stop, each (stop - start, n), per s and s².

    positions: of all samples, (samples, n), at `rate` Hz; at least `processing.span` of them
    """
    reach = processing.reach
    low, high = max(0, start - reach), min(len(positions), stop + reach)
    window = np.asarray(positions[low:high])
    if processing.derivative == "five-point":
        motion = (window, *_five_point(window, rate))
    elif processing.derivative == "spline":
        motion = (window, *_splined(window, rate, processing, low == 0, high == len(positions)))
    else:
        motion = _savitzky_golay(window, rate, processing)
    q, qd, qdd = (x[start - low : stop - low] for x in motion)
    return q, qd, qdd


def _five_point(q: Array, rate: float) -> tuple[Array, Array]:
    return _weighted(q, FIRST) * (rate / 12), _weighted(q, SECOND) * (rate**2 / 12)


def _weighted(q: Array, weights: NDArray[np.int_]) -> Array:
    """Return Σ_k w_pk (q_k - q_p): the weights sum to 0, and this way equal samples give exactly 0."""
    out = np.empty_like(q)
    last = len(q) - 5
    for p, (first, count) in enumerate([(0, 1), (0, 1), (0, last + 1), (last, 1), (last, 1)]):
        here = q[first + p : first + p + count]
        at = out[first + p : first + p + count]
        at[:] = 0.0
        for k in range(5):
            if k != p and weights[p, k]:
                at += weights[p, k] * (q[first + k : first + k + count] - here)
    return out


def _savitzky_golay(q: Array, rate: float, processing: Processing) -> tuple[Array, Array, Array]:
    """Return q, q̇, q̈ of the polynomial fitted to each window; at the ends, to the last full window."""
    savgol = extra("scipy.signal").savgol_filter
    fitted = [
        savgol(q, processing.window, processing.degree, deriv=m, delta=1 / rate, axis=0) for m in range(3)
    ]
    return fitted[0], fitted[1], fitted[2]


def _splined(q: Array, rate: float, processing: Processing, first: bool, last: bool) -> tuple[Array, Array]:
    """Return q̇, q̈ of the natural spline of degree 5 through the samples, as OpenSim derives coordinates.

    OpenSim's spline also goes through what its filter continued the log by. A filter without a shift in time
    leaves the symmetry of such a continuation, so that it is the filtered log's own: turned about its end, or
    mirrored there. Where nothing is filtered, the spline ends with the log.

    first, last: whether the samples begin and end with the log
    """
    padding = "none" if processing.lowpass is None else processing.lowpass.padding
    reach = min(processing.reach, len(q) - 1) if padding in ("odd", "even") else 0
    front, back = (reach if at_end else 0 for at_end in (first, last))
    whole = [_extension(q[: front + 1], padding), q, _extension(q[-1 : -back - 2 : -1], padding)[::-1]]
    knots = np.concatenate(whole)
    held = [(order, np.zeros(q.shape[1])) for order in range(SPLINE_DEGREE // 2 + 1, SPLINE_DEGREE)]
    make = extra("scipy.interpolate").make_interp_spline
    spline = make(np.arange(-front, len(q) + back), knots, SPLINE_DEGREE, bc_type=(held, held))
    at = np.arange(len(q))
    qd, qdd = (np.asarray(spline(at, order)) * rate**order for order in (1, 2))
    return qd, qdd
