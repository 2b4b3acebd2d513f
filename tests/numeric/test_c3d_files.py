"""Names, rates, frames and places of markers in C3D files, and what the text format has of these."""

import re
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linkwise.analysis.markers.c3d import read_c3d
from linkwise.analysis.opensim.trc_file import read_trc
from linkwise.errors import LinkwiseError

ezc3d: Any = pytest.importorskip("ezc3d")

FRAMES = 50


def written(path: Path, points: np.ndarray, names: list[str]) -> Path:
    """Write points (S, M, 3) in mm at 100 Hz."""
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    file["parameters"]["POINT"]["LABELS"]["value"] = names
    file["parameters"]["POINT"]["UNITS"]["value"] = ["mm"]
    file["data"]["points"] = np.concatenate([points.T, np.ones((1, *points.T.shape[1:]))])
    file.write(str(path))
    return path


def places(count: int) -> np.ndarray:
    return np.random.default_rng(1).uniform(100.0, 900.0, size=(FRAMES, count, 3))


def with_bytes(file: Path, old: bytes, new: bytes) -> Path:
    """Put bytes in the place of others, which stand once in the file, and are as many."""
    content = file.read_bytes()
    assert content.count(old) == 1
    assert len(old) == len(new)
    file.write_bytes(content.replace(old, new))
    return file


def last_frame(file: Path, last: int) -> Path:
    content = bytearray(file.read_bytes())
    struct.pack_into("<H", content, 8, last)
    file.write_bytes(content)
    return file


def test_markers_beyond_255_have_their_names(tmp_path: Path) -> None:
    points, names = places(300), [f"m{at}" for at in range(300)]
    markers = read_c3d(written(tmp_path / "many.c3d", points, names), "+X,+Y").markers
    assert markers.names == tuple(names)
    assert markers.places[:, 299] == pytest.approx(points[:, 299] / 1000, rel=1e-6)


def test_names_beyond_ascii_are_read_in_utf_8_and_in_latin_1(tmp_path: Path) -> None:
    for raw, name in ((b"T\xeate", "Tête"), (b"T\xc3\xaa", "Tê"), ("足1".encode(), "足1")):
        file = written(tmp_path / "names.c3d", places(1), ["x" * len(raw)])
        assert read_c3d(with_bytes(file, b"x" * len(raw), raw), "+X,+Z").markers.names == (name,)


@pytest.mark.parametrize("rate", [0.0, -100.0, np.nan, np.inf])
def test_a_rate_that_gives_frames_no_time_is_refused(rate: float, tmp_path: Path) -> None:
    file = written(tmp_path / "rate.c3d", places(1), ["heel"])
    content = file.read_bytes().replace(struct.pack("<f", 100.0), struct.pack("<f", rate))
    file.write_bytes(content)
    with pytest.raises(LinkwiseError, match=r"rate\.c3d: POINT:RATE is .*; write the frames a second there"):
        read_c3d(file, "+X,+Z")


def test_frames_that_the_head_cannot_count_are_those_of_the_parameters(tmp_path: Path) -> None:
    file = last_frame(written(tmp_path / "long.c3d", places(1), ["heel"]), 65535)
    assert len(read_c3d(file, "+X,+Z").markers.time) == FRAMES
    content = re.sub(rb"(FRAMES..\x02.?)\x32\x00", b"\\g<1>P\0", file.read_bytes(), flags=re.DOTALL)
    assert content != file.read_bytes()
    file.write_bytes(content)
    with pytest.raises(
        LinkwiseError, match=r"long\.c3d: POINT:FRAMES says 80 frames, and \d+ are there: it was"
    ):
        read_c3d(file, "+X,+Z")
    again = ezc3d.c3d(str(file))
    again.add_parameter("TRIAL", "ACTUAL_START_FIELD", [11, 0])
    again.add_parameter("TRIAL", "ACTUAL_END_FIELD", [5, 1])
    again.write(str(file))
    with pytest.raises(
        LinkwiseError, match=r"TRIAL:ACTUAL_END_FIELD says 65531 frames, and \d+ are there: it was cut"
    ):
        read_c3d(last_frame(file, 65535), "+X,+Z")


@pytest.mark.parametrize("far", [np.inf, -2e7])
def test_a_marker_at_infinity_is_refused_with_its_frame(far: float, tmp_path: Path) -> None:
    points = places(2)
    points[30, 1, 2] = far
    file = written(tmp_path / "far.c3d", points, ["heel", "toe"])
    with pytest.raises(
        LinkwiseError, match=r"far\.c3d: frame 31: a marker is farther than 10000 m away, toe"
    ):
        read_c3d(file, "+X,+Z")


def test_a_text_file_may_have_a_mark_before_it_and_a_comma_in_its_rate(tmp_path: Path) -> None:
    head = "DataRate\tCameraRate\tNumFrames\tNumMarkers\tUnits"
    rows = "\n".join(f"{at + 1}\t{at / 100}\t1\t2\t3" for at in range(5))
    for rate, told in (
        ("100,00", ()),
        ("200,0", ("its head says 200 Hz, and its times 100 Hz",)),
        ("x", ("'x'",)),
    ):
        text = (
            f"PathFileType\t4\n{head}\n{rate}\t100\t5\t1\tm\nFrame#\tTime\theel\n\t\tX1\tY1\tZ1\n\n{rows}\n"
        )
        (tmp_path / "mark.trc").write_text(text, encoding="utf-8-sig")
        markers = read_trc(tmp_path / "mark.trc")
        assert markers.places[0, 0] == pytest.approx([1, 2, 3])
        assert len(markers.told) == len(told)
        assert all(one in line for one, line in zip(told, markers.told, strict=True))
