"""MuJoCo is kept from what a robot does not need, and from what has no end."""

import os
import signal
import time
from pathlib import Path
from typing import Any

import pytest
from linkwise import LinkwiseError, read_system
from linkwise.own_process import ProcessLimits
from linkwise.robot import read_robot
from linkwise.robot.readers.mjcf import reader
from linkwise.robot.readers.mjcf.files import mjcf_files

pytest.importorskip("mujoco")

ROBOT = """<mujoco model="rod"><compiler meshdir="parts" {compiler}/><asset>{asset}</asset>{more}
<worldbody>{ground}<body name="rod"><joint name="hinge" axis="0 1 0"/>{body}</body></worldbody></mujoco>"""
INERTIAL = '<inertial pos="0 0 0.1" mass="1" diaginertia="0.1 0.2 0.3"/>'
MESH, ITS_GEOM = '<mesh name="rod" file="rod.obj"/>', '<geom type="mesh" mesh="rod"/>'
ROD = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 6\nf 1 3 2\nf 1 4 3\nf 1 2 4\nf 2 3 4\n"
"""A tetrahedron of 1 m³."""


def written(folder: Path, **parts: str) -> Path:
    (folder / "parts").mkdir()
    (folder / "parts" / "rod.obj").write_text(ROD)
    path = folder / "rod.xml"
    given = dict.fromkeys(("compiler", "asset", "more", "ground"), "") | {"body": INERTIAL} | parts
    path.write_text(ROBOT.format(**given))
    return path


def mass(path: Path) -> Any:
    return read_robot(path).links[0].mass


UNSEEN = {
    "texture": {"asset": '<texture name="t" type="2d" builtin="checker" width="30000" height="30000"/>'},
    "cube": {"asset": '<texture name="t" type="cube" builtin="gradient" width="9000" height="54000"/>'},
    "no picture": {
        "asset": '<texture type="2d" file="no.png"/><material name="m" texture="no"/>',
        "body": f'{INERTIAL}<geom size="1" material="m"/>',
    },
    "no sides": {"asset": '<texture name="t" type="cube" fileright="a.png" fileleft="b.png"/>'},
    "terrain": {
        "asset": '<hfield file="no.png" size="1 1 1 1"/>',
        "ground": '<geom type="hfield" hfield="no"/>',
    },
    "no mesh": {"asset": '<mesh file="no.obj" scale="1 0 1"/>', "ground": '<geom type="mesh" mesh="no"/>'},
    "mesh": {"asset": '<mesh file="no.obj"/>', "body": f'{INERTIAL}<geom type="box" mesh="no" mass="9"/>'},
}


@pytest.mark.parametrize("what", UNSEEN)
def test_what_is_only_seen_or_touched_is_not_opened(what: str, tmp_path: Path) -> None:
    start = time.process_time()
    assert mass(written(tmp_path, **UNSEEN[what])) == 1.0
    assert time.process_time() - start < 2.0


def test_mesh_that_weighs_is_opened(tmp_path: Path) -> None:
    path = written(tmp_path, asset=MESH, body=ITS_GEOM)
    assert mass(path) == pytest.approx(1000.0)
    (tmp_path / "parts" / "rod.obj").unlink()
    with pytest.raises(LinkwiseError, match=r"MuJoCo cannot compile it: Error: Error opening file .*rod.obj"):
        read_system(path)


def test_mesh_weighs_where_the_compiler_prefers_it(tmp_path: Path) -> None:
    own = written(tmp_path, asset=MESH, body=INERTIAL + ITS_GEOM, compiler='inertiafromgeom="true"')
    assert mass(own) == pytest.approx(1000.0)
    holder = tmp_path / "holder.xml"
    holder.write_text(
        '<mujoco><asset><model name="rod" file="rod.xml"/></asset><worldbody><body name="base">'
        '<attach model="rod" body="rod" prefix="a"/></body></worldbody></mujoco>'
    )
    assert [float(link.mass) for link in read_robot(holder).links] == pytest.approx([1000.0])


PIPES = {
    "include": {"more": '<include file="{}"/>'},
    "model": {"asset": '<model name="m" file="{}"/>'},
    "mesh": {"asset": '<mesh name="m" file="{}"/>', "body": '<geom type="mesh" mesh="m"/>'},
    "texture": {"asset": "<texture name='t' type='2d' file = '{}'/>"},
    "side": {"asset": '<texture name="t" type="cube" fileup="{}"/>'},
    "skin": {"asset": '<skin name="s" file="{}"/>'},
    "flex": {"ground": '<flexcomp name="f" type="mesh" file="{}"/>'},
}


@pytest.mark.parametrize("what", PIPES)
def test_pipe_is_refused_before_anybody_waits_for_its_end(what: str, tmp_path: Path) -> None:
    path = written(tmp_path, **{key: text.format("pi&#112;e.xml") for key, text in PIPES[what].items()})
    os.mkfifo(tmp_path / "parts" / "pipe.xml")
    with pytest.raises(LinkwiseError, match=r"rod.xml: \S+/parts/pipe.xml: this is a pipe.*; give a file"):
        read_system(path)


def test_pipe_of_an_included_file_is_refused(tmp_path: Path) -> None:
    path = written(tmp_path, more='<include file="parts/more.xml"/>')
    (tmp_path / "parts" / "more.xml").write_text(
        '<mujoco><asset><texture name="t" file="x.png"/></asset></mujoco>'
    )
    assert mass(path) == 1.0
    os.mkfifo(tmp_path / "parts" / "x.png")
    with pytest.raises(LinkwiseError, match=r"parts/x.png: this is a pipe"):
        read_system(path)


def test_files_of_a_robot_are_all_that_its_files_name(tmp_path: Path) -> None:
    path = written(tmp_path, more='<include file="sub/more.xml"/>')
    (tmp_path / "sub").mkdir()
    (tmp_path / "sub" / "more.xml").write_text(
        '<mujoco><compiler strippath="true" meshdir="meshes"/><include file="../rod.xml"/>'
        '<asset><mesh file="far/away/tip.stl"/></asset></mujoco>'
    )
    (tmp_path / "sub" / "meshes").mkdir()
    (tmp_path / "sub" / "meshes" / "tip.stl").write_bytes(b"")
    found = mjcf_files(path)
    assert found.documents == (path, tmp_path / "sub" / "more.xml")
    assert found.others == (tmp_path / "sub" / "meshes" / "tip.stl",)


def test_more_files_than_a_robot_has_are_not_looked_for(tmp_path: Path) -> None:
    path = written(tmp_path, asset="".join(f'<mesh file="{k}.obj"/>' for k in range(99_999)))
    with pytest.raises(LinkwiseError, match=r"its files may be in more than 100,000 places"):
        read_system(path)


ENDLESS = '<replicate count="30000"><body><joint/><geom size="0.1"/></body></replicate>'


def test_compiler_that_does_not_end_is_ended(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "LIMITS", ProcessLimits(1, 1 << 30))
    path = written(tmp_path, ground=ENDLESS)
    before = os.times()
    with pytest.raises(
        LinkwiseError, match="MuJoCo's compiler takes more than 1 s of processor time; repeat"
    ):
        read_system(path)
    assert os.times().children_user - before.children_user < 3.0


@pytest.mark.parametrize("size", ['nrow="30000" ncol="20000"', 'nrow="2000000000" ncol="2000000000"'])
def test_compiler_that_takes_too_much_memory_is_refused_it(size: str, tmp_path: Path) -> None:
    path = written(tmp_path, asset=f'<hfield name="t" {size} size="1 1 1 1"/>')
    with pytest.raises(
        LinkwiseError, match="MuJoCo's compiler takes more than 750 MiB of memory; repeat less"
    ):
        read_system(path)


def test_compiler_that_crashes_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(reader, "compile_model", lambda *_: os.kill(os.getpid(), signal.SIGSEGV))
    with pytest.raises(LinkwiseError, match=r"MuJoCo's compiler does not survive it: it ended .* by SIGSEGV"):
        read_system(written(tmp_path))
