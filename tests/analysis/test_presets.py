"""Presets of human segments: what they say against their source, which link is what, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from helpers.command_line import run_linkwise
from helpers.motion_logs import smooth, write_csv
from helpers.urdf_text import joint, link, robot
from linkwise import generate, read_system, write_package
from linkwise.analysis import analyze
from linkwise.analysis.segment_presets import PRESETS, WORDS, segments_of
from linkwise.analysis.show.page_certainty import assumptions

NAMES = ("ground", "tibia_r", "LeftForeArm", "box")
JOINTS = ("knee", "elbow", "grip")
LEG = robot(*map(link, NAMES), *(joint(*each) for each in zip(JOINTS, NAMES, NAMES[1:], strict=False)))
"""Robot whose root stands still; its other links have 1.5 kg each."""


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of a robot whose links are segments, but for one,, and a log."""
    folder = tmp_path_factory.mktemp("presets")
    (folder / "leg.urdf").write_text(LEG)
    write_package(generate(read_system(folder / "leg.urdf"), ["numpy"]), folder / "leg")
    write_csv(folder / "log.csv", smooth(30, 3), JOINTS)
    return folder


@pytest.mark.parametrize(("preset", "body"), [("zatsiorsky-men", 73.0), ("zatsiorsky-women", 61.9)])
def test_segments_add_up_to_the_body_that_was_measured(preset: str, body: float) -> None:
    """Mean masses of the same data in de Leva 1996, J. Biomech. 29:1223."""
    segments = PRESETS[preset].segments
    assert set(segments) == set(WORDS)
    limbs = {"foot", "shank", "thigh", "hand", "forearm", "upper arm"}
    total = sum(one.mass * (2 if name in limbs else 1) for name, one in segments.items())
    assert total == pytest.approx(body, rel=0.006)


RADII = {
    ("zatsiorsky-men", "foot"): (25.81, 25.7, 24.5),
    ("zatsiorsky-men", "shank"): (43.40, 25.5, 24.9),
    ("zatsiorsky-men", "thigh"): (42.22, 32.9, 32.9),
    ("zatsiorsky-men", "forearm"): (26.89, 27.6, 26.5),
    ("zatsiorsky-men", "upper arm"): (28.17, 28.5, 26.9),
    ("zatsiorsky-women", "foot"): (22.83, 29.9, 27.9),
    ("zatsiorsky-women", "shank"): (43.23, 27.1, 26.7),
    ("zatsiorsky-women", "thigh"): (36.85, 36.9, 36.4),
    ("zatsiorsky-women", "forearm"): (26.43, 26.1, 25.7),
    ("zatsiorsky-women", "upper arm"): (27.51, 27.8, 26.0),
}
"""Lengths in cm, and sagittal and transverse radii of gyration in % of them: de Leva 1996, table 4."""


@pytest.mark.parametrize(("preset", "segment"), RADII)
def test_moments_of_limbs_are_those_of_published_radii(preset: str, segment: str) -> None:
    """I = m r^2, up to the three digits that both sources print."""
    length, *percents = RADII[preset, segment]
    one = PRESETS[preset].segments[segment]
    moments = [one.mass * (percent / 100 * length) ** 2 for percent in percents]
    assert [one.sagittal, one.transverse] == pytest.approx(moments, rel=0.008)


@pytest.mark.parametrize("preset", list(PRESETS))
def test_drawn_segments_have_the_errors_of_the_source(preset: str) -> None:
    rng = np.random.default_rng(3)
    for name, one in PRESETS[preset].segments.items():
        parts = one.deviations
        mass = one.mass * (1.0 + parts["mass"] * rng.standard_normal(200_000))
        moments = mass * (1.0 + parts["radii"] * rng.standard_normal(200_000)) ** 2
        assert mass.std() == pytest.approx(one.mass_error, rel=0.01), name
        told = np.hypot(one.sagittal_error / one.sagittal, one.transverse_error / one.transverse) / np.sqrt(2)
        assert moments.std() / moments.mean() == pytest.approx(told, rel=0.04), name


@pytest.mark.parametrize(
    ("name", "segments"),
    [
        ("femur_r", ["thigh"]),
        ("RightUpLeg", ["thigh"]),
        ("L_UPPER_ARM", ["upper arm"]),
        ("leftForearm2", ["forearm"]),
        ("lower_leg", ["shank"]),
        ("calcn_l", ["foot"]),
        ("torso", []),
        ("handle", []),
        ("femur_head", ["thigh", "head"]),
    ],
)
def test_words_in_names_tell_segments(name: str, segments: list[str]) -> None:
    assert segments_of(name) == segments


def test_links_have_what_their_segments_have_unless_stated(leg: Path) -> None:
    (leg / "own.toml").write_text("""schema = 1
[all]
preset = "zatsiorsky-men"
radii = "3 %"
[link.tibia_r]
preset = "zatsiorsky-women"
mass = "0.3 kg"
[link.box]
segment = "hand"
""")
    record = analyze(leg / "log.csv", leg / "leg", uncertain=leg / "own.toml").uncertain
    assert record is not None
    told = {one["name"]: (one["mass"], one["centre"][1], one["radii"]) for one in record["links"]}
    assert told["LeftForeArm"] == pytest.approx((0.101 / 1.177, 0.0114, 0.03))
    shank = 0.5 * np.sqrt(((63.8 / 409.9) ** 2 + (62.2 / 399.7) ** 2) / 2 - (0.36 / 3.0) ** 2)
    assert told["tibia_r"] == pytest.approx((0.2, 0.0039, shank))
    assert told["box"] == pytest.approx((0.063 / 0.447, 0.0112, 0.03))
    assert record["presets"]["zatsiorsky-women"]["segments"] == {"tibia_r": "shank"}
    page = next(line for line in assumptions(record) if line.startswith("Presets: "))
    assert "Kinetics of Human Motion, 2002" in page
    assert "LeftForeArm forearm" in page


def test_the_command_tells_which_link_is_which_segment(leg: Path, tmp_path: Path) -> None:
    (tmp_path / "some.toml").write_text(
        'schema = 1\n[link.tibia_r]\npreset = "zatsiorsky-men"\n[link.box]\nmass = "5 %"\n'
    )
    flags = ("--robot", leg / "leg", "--out", "out", "--uncertain", "some.toml")
    ended = run_linkwise("analyze", leg / "log.csv", *flags, folder=tmp_path)
    assert ended.returncode == 0, ended.stderr
    assert "some.toml: zatsiorsky-men: tibia_r is shank\n" in ended.stdout
    assert "Kinetics of Human Motion" in (tmp_path / "out/analysis.json").read_text()


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("[all]\npreset = 'zatsiorsky-men'", "[all]: the name of link 'box' fits no segment of preset"),
        (
            "[all]\npreset = 'zatsiorsky-men'\n[link.box]\nmass = '5 %'\nradii = '5 %'",
            "in [link.box] write segment, one of foot, shank, thigh, hand, forearm, upper arm, head, thorax, "
            "abdomen, pelvis, or mass, centre and radii",
        ),
        (
            "[all]\npreset = 'dempster'",
            "[all]: preset is 'dempster'; known are zatsiorsky-men, zatsiorsky-women",
        ),
        ("[link.box]\npreset = 3", "[link.box]: preset is 3; known are"),
        (
            "[link.box]\npreset = 'zatsiorsky-men'\nsegment = 'knee'",
            "[link.box]: segment is 'knee'; known are",
        ),
        ("[link.box]\nsegment = 'hand'", "[link.box]: segment needs a preset, here or in [all]"),
        ("[all]\nsegment = 'hand'", "[all] has the unknown key 'segment'"),
    ],
)
def test_a_preset_that_does_not_fit_is_refused_in_one_line(
    text: str, told: str, leg: Path, tmp_path: Path
) -> None:
    (tmp_path / "bad.toml").write_text(f"schema = 1\n{text}\n")
    flags = ("--robot", leg / "leg", "--out", "out", "--uncertain", "bad.toml")
    ended = run_linkwise("analyze", leg / "log.csv", *flags, folder=tmp_path)
    assert ended.returncode == 2
    assert ended.stderr.count("\n") == 1
    assert told in ended.stderr
    assert not (tmp_path / "out").exists()
