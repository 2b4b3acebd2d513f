"""Springs, damping, friction and armature of joints in an analysis: columns and causes of their own."""

import json

import numpy as np
import pytest
from helpers.urdf_text import joint, link, robot
from linkwise import generate, read_system, write_package
from linkwise.analysis import analyze
from linkwise.analysis.load_robot import load_robot
from linkwise.analysis.request import Outputs, Request
from linkwise.analysis.run import analyze_to
from linkwise.analysis.show.page import page_data
from linkwise.progress import silent

ARM = robot(
    *map(link, "abc"),
    joint("ab", "a", "b", inner='<dynamics damping="0.5" friction="0.2"/>'),
    joint("bc", "b", "c"),
    """<gazebo reference="bc"><springStiffness>3</springStiffness>
    <springReference>0.1</springReference></gazebo>""",
)

OWN = ("tau_spring", "tau_damping", "tau_friction", "tau_armature")


@pytest.fixture(scope="module")
def analysed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("passive")
    (folder / "arm.urdf").write_text(ARM)
    write_package(generate(read_system(folder / "arm.urdf"), ["numpy"]), folder / "arm")
    time = np.arange(401) / 200
    motion = np.column_stack([time, np.sin(2 * time), 0.5 * np.cos(3 * time)])
    np.savetxt(folder / "log.csv", motion, delimiter=",", header="time,ab,bc", comments="")
    return folder, analyze(folder / "log.csv", folder / "arm")


def test_they_have_columns_where_the_file_has_them_and_the_joint_torque_sums_them(analysed):
    _, result = analysed
    names = {c.name for c in result.columns}
    assert {name for name in names if name.startswith(OWN)} == {
        "tau_damping/ab",
        "tau_friction/ab",
        "tau_spring/bc",
    }
    np.testing.assert_allclose(result["tau_damping/ab"], 0.5 * result.qd[:, 0], rtol=1e-14)
    np.testing.assert_array_equal(result["tau_friction/ab"], 0.2 * np.sign(result.qd[:, 0]))
    np.testing.assert_allclose(result["tau_spring/bc"], 3 * (result.q[:, 1] - 0.1), rtol=1e-12, atol=1e-14)
    links = result.partial_torque.sum(axis=2)
    lost = result["tau_damping/ab"] + result["tau_friction/ab"]
    np.testing.assert_allclose(result["tau/ab"], links[:, 0] + lost, rtol=0, atol=1e-12)
    np.testing.assert_allclose(result["tau/bc"], links[:, 1] + result["tau_spring/bc"], rtol=0, atol=1e-12)
    assert result.closure.links_relative < 1e-14
    np.testing.assert_array_equal(result.joint_power, result.torque * result.qd)


def test_every_file_and_picture_has_them(analysed, tmp_path):
    folder, result = analysed
    wanted = Outputs("csv", ("shares",), page=False, power_terms=True)
    analyze_to(
        tmp_path / "out",
        folder / "log.csv",
        load_robot(folder / "arm"),
        Request(outputs=wanted),
        silent,
    )
    header = (tmp_path / "out/analysis.csv").read_text().splitlines()[0].split(",")
    assert {"tau_spring/bc", "power_spring/bc", "power_damping/ab"} <= set(header)
    record = json.loads((tmp_path / "out/analysis.json").read_text())
    meanings = {column["name"]: column["meaning"] for column in record["columns"]}
    assert meanings["tau_spring/bc"] == "what the joint takes for its own spring"
    named = result.to_xarray().passive_torque
    for source, of in (("spring", "bc"), ("damping", "ab"), ("friction", "ab")):
        np.testing.assert_array_equal(named.sel(source=source, joint=of), result[f"tau_{source}/{of}"])
    labels = [text.get_text() for text in result.figure("shares").legends[0].get_texts()]
    assert labels[:4] == ["gravity", "own spring", "own damping", "own friction"]
    assert {"tau_spring", "tau_damping"} <= {c["quantity"] for c in json.loads(page_data(result))["columns"]}
