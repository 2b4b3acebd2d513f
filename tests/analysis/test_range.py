"""A range of time of a log: what is analysed of it, what is asked of loads beside it, and what is refused."""

import numpy as np
import pytest
from helpers.motion_logs import PLANAR3, smooth, write_csv
from linkwise import LinkwiseError, Load
from linkwise.analysis import Lowpass, Processing, analyze
from linkwise.analysis.filtering import padding_length
from scipy.signal import butter, sosfiltfilt


def test_a_range_is_cut_out_after_the_filter(tmp_path):
    table = smooth(200, 3)
    log = write_csv(tmp_path / "log.csv", table)
    processing = Processing(lowpass=Lowpass(6.0), start=0.5000004, stop=1.25)
    result = analyze(log, PLANAR3, processing=processing)
    assert result.time.tolist() == table[50:126, 0].tolist(), "times are rounded where they are written"
    sos = butter(2, 6.0, fs=100.0, output="sos")
    filtered = sosfiltfilt(sos, table[:, 1:], axis=0, padlen=padding_length(sos, len(table)))
    assert np.abs(result.q - filtered[50:126]).max() < 1e-12
    steps = [filtered[50 + k : 126 + k] for k in (-2, -1, 1, 2)]
    speed = (steps[0] - 8 * steps[1] + 8 * steps[2] - steps[3]) * 100 / 12
    assert np.abs(result.qd - speed).max() < 1e-10, "the ends of a range are not those of the log"


def test_loads_have_to_cover_the_range_alone(tmp_path):
    log = write_csv(tmp_path / "log.csv", smooth(200, 3))
    time = np.linspace(0.3, 0.9, 61)
    push = Load("push", "link3", np.ones((61, 3)), time=time)
    result = analyze(log, PLANAR3, loads=[push], processing=Processing(start=0.3, stop=0.9))
    assert result.load_torque.shape == (61, 3, 1)
    with pytest.raises(LinkwiseError, match=r"begins at 0.3 s, the motion at 0 s; analyse less .* --from"):
        analyze(log, PLANAR3, loads=[push])


@pytest.mark.parametrize(
    ("start", "stop", "message"),
    [
        (1.0, 0.5, "--from 1 is not before --to 0.5"),
        (float("nan"), None, "--from nan: give a time in s"),
        (7.0, None, "--from 7: 0 samples are there, and 2 are needed; the log runs from 0 to 1.99 s"),
        (0.501, 0.512, "--from 0.501 --to 0.512: 1 samples are there"),
    ],
)
def test_a_range_without_a_movement_is_refused(tmp_path, start, stop, message):
    log = write_csv(tmp_path / "log.csv", smooth(200, 3))
    with pytest.raises(LinkwiseError, match=message.replace(".", "[.]")):
        analyze(log, PLANAR3, processing=Processing(start=start, stop=stop))


@pytest.mark.parametrize(
    ("start", "stop", "told"),
    [
        (-0.5, 1.0, ("--from -0.5 is before the log, which begins at 0 s",)),
        (0.5, 2.5, ("--to 2.5 is after the log, which ends at 1.99 s",)),
        (-0.005, 1.995, ()),  # less than a sample
    ],
)
def test_a_range_beyond_the_log_is_warned_of(tmp_path, start, stop, told):
    log = write_csv(tmp_path / "log.csv", smooth(200, 3))
    result = analyze(log, PLANAR3, processing=Processing(start=start, stop=stop))
    assert result.warnings == told
