"""Two things of one name are refused, wherever the names come from."""

from pathlib import Path

import pytest
from helpers.urdf_text import chain, joint, link, robot
from linkwise import Coordinate, LinkwiseError, read_system
from linkwise.robot.robot import Joint, Link, Robot

EYE = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def arm(coordinates: tuple[str, ...], links: tuple[str, ...]) -> Robot:
    return Robot(
        "arm",
        tuple(map(Coordinate, coordinates)),
        tuple(
            Link(
                name,
                None if at == 0 else at - 1,
                Joint(f"hinge{at}", "revolute", at, 1.0, EYE, (0.0, 0.0, 0.1)),
                1.0,
                (0.1, 0.0, 0.0),
                EYE,
            )
            for at, name in enumerate(links)
        ),
    )


def test_a_robot_made_in_python_names_each_joint_and_link_once() -> None:
    assert len(arm(("a", "b"), ("one", "two")).links) == 2
    with pytest.raises(LinkwiseError, match=r"^two joints are named 'a'; rename one$"):
        arm(("a", "a"), ("one", "two"))
    with pytest.raises(LinkwiseError, match=r"^two links are named 'one'; rename one$"):
        arm(("a", "b"), ("one", "one"))
    with pytest.raises(LinkwiseError, match=r"^a joint has an empty name; name it$"):
        arm(("a", " "), ("one", "two"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            robot(link("a"), link("b"), link("b"), joint("ab", "a", "b")),
            "2 links are named 'b'; rename all but one",
        ),
        (chain(joint("j", "a", "b"), joint("j", "b", "c")), "2 joints are named 'j'; rename all but one"),
        (
            chain(joint("slab", "a", "b", type="planar"), joint("slab_x", "b", "c")),
            "2 joints are named 'slab_x', one of them made from a joint's type; rename it",
        ),
    ],
    ids=["links", "joints", "a part of a planar joint"],
)
def test_a_file_names_each_joint_and_link_once(text: str, message: str, tmp_path: Path) -> None:
    (tmp_path / "robot.urdf").write_text(text)
    with pytest.raises(LinkwiseError) as caught:
        read_system(tmp_path / "robot.urdf")
    assert str(caught.value) == f"{tmp_path / 'robot.urdf'}: {message}"
