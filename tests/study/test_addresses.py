"""Studies whose files lie in a store of objects, as S3 is one."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from helpers import urdf_text
from helpers.motion_logs import JOINTS
from helpers.studies import CHOICES, CYCLES, HEAD, QUICK, TRIALS, Here, write_study
from linkwise import LinkwiseError
from linkwise.study import run_study
from linkwise.study.patterns import expanded

pd = pytest.importorskip("pandas")
s3fs = pytest.importorskip("s3fs", reason="needs s3fs")
server = pytest.importorskip("moto.server", reason="needs moto[s3] and flask-cors")

PUSH = """<OpenSimDocument><ExternalLoads><objects><ExternalForce name="push">
<applied_to_body>d</applied_to_body><force_expressed_in_body>ground</force_expressed_in_body>
<force_identifier>f</force_identifier></ExternalForce></objects>
<datafile>forces.sto</datafile></ExternalLoads></OpenSimDocument>"""
NUMBERS = """push
version=1
nRows=2
nColumns=4
inDegrees=no
endheader
time\tfx\tfy\tfz
0\t1\t2\t0
3\t1\t2\t0
"""


@pytest.fixture(scope="module")
def store() -> Iterator[Any]:
    """An S3 on this machine, with a bucket."""
    there = server.ThreadedMotoServer(port=0)
    there.start()
    host, port = there.get_host_and_port()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("AWS_ENDPOINT_URL", f"http://{host}:{port}")
        patch.setenv("AWS_ACCESS_KEY_ID", "nobody")
        patch.setenv("AWS_SECRET_ACCESS_KEY", "nobody")
        patch.setenv("AWS_DEFAULT_REGION", "us-east-1")
        files = s3fs.S3FileSystem()
        files.mkdir("lab")
        yield files
    there.stop()


def test_logs_loads_and_robots_are_read_where_they_lie(store: Any, tmp_path: Path) -> None:
    """A study of files beside it and one of files of a store give the same tables; a changed log is done
    again."""
    (tmp_path / "arm.urdf").write_text(urdf_text.chain(*map(urdf_text.joint, JOINTS, "abc", "bcd")))
    (tmp_path / "push.xml").write_text(PUSH)
    (tmp_path / "forces.sto").write_text(NUMBERS)
    beside = TRIALS.replace('"planar3"', '"arm.urdf"') + 'loads = ["push.xml"]\n'
    there = re.sub(r'"(data|arm|push)', r'"s3://lab/\1', beside)
    file = write_study(tmp_path, HEAD, QUICK, CHOICES, CYCLES, beside, subjects=1)
    assert run_study(file, tmp_path / "local", Here()).broken == ()
    for path in [*tmp_path.glob("*.*"), *tmp_path.rglob("*.csv")]:
        store.put(str(path), f"lab/{path.relative_to(tmp_path)}")
    file.write_text("".join((HEAD, QUICK, CHOICES, CYCLES, there)))
    shutil.rmtree(tmp_path / "data")

    assert len(run_study(file, tmp_path / "out", Here()).done) == 4
    local, remote = (pd.read_parquet(tmp_path / name / "trials") for name in ("local", "out"))
    pd.testing.assert_frame_equal(local, remote)

    store.pipe("lab/forces.sto", NUMBERS.replace("\t2\t", "\t5\t").encode())
    again = Here()
    assert len(run_study(file, tmp_path / "out", again).done) == len(again.given) == 4
    assert not local.equals(pd.read_parquet(tmp_path / "out/trials"))
    assert run_study(file, tmp_path / "out", Here()).fresh == 0


def test_a_pattern_finds_files_of_a_store_as_it_does_beside_the_study(store: Any, tmp_path: Path) -> None:
    (tmp_path / "two").mkdir()
    for name in ("xy", "xyz"):
        (tmp_path / f"two/{name}.csv").touch()
        store.pipe(f"lab/two/{name}.csv", b"")
    for place in ("", "s3://lab/"):
        entry = {"log": f"{place}two/{{a}}{{b}}.csv", "name": "{a} {b}"}
        with pytest.raises(LinkwiseError, match=r"two/xyz\.csv fits the pattern in two ways, a=x, b=yz and"):
            list(expanded(entry, tmp_path))
        entry["log"] = f"{place}two/{{a}}{{b}}z.csv"
        assert [one["name"] for one in expanded(entry, tmp_path)] == ["x y"]


@pytest.mark.parametrize("log", ["gone.csv", "folder"])
def test_what_is_no_file_of_the_store_is_told(log: str, store: Any, tmp_path: Path) -> None:
    store.pipe("lab/folder/walk.csv", b"1")
    trial = f'[[trial]]\nname = "a"\nlog = "s3://lab/{log}"\nrobot = "planar3"\ncondition = "x"\n'
    file = write_study(tmp_path, HEAD, trial)
    with pytest.raises(LinkwiseError, match=rf"trial 'a': s3://lab/{log}: no such file"):
        run_study(file, tmp_path / "out", Here())
