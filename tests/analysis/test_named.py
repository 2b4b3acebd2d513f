"""Results of analyses with names along their axes, in files, in tables of pandas and polars, in notebooks."""

import html.parser
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA
from helpers.motion_logs import LEG, PLANAR3, smooth, write_csv
from house.test_names import HOSTILE, chain
from linkwise import Contact, Load, Options, Reading, generate, read_robot, read_system, write_package
from linkwise.analysis import analyze
from linkwise.cli.app import app
from linkwise.errors import LinkwiseError
from typer.testing import CliRunner

xr = pytest.importorskip("xarray")

COORDINATES = ("pelvis_tx", "pelvis_ty", "pelvis_tilt", "hip_flexion_r", "knee_angle_r", "ankle_angle_r")


@pytest.fixture(scope="module")
def leg(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """A leg that stands on its foot and bears a load, what accelerates it, and how power flows."""
    folder = tmp_path_factory.mktemp("leg")
    write_package(generate(read_system(LEG), ["numpy"]), folder / "leg")
    log = write_csv(folder / "walk.csv", smooth(60, 6) * [1, *[0.2] * 6], COORDINATES)
    return analyze(
        log,
        folder / "leg",
        loads=[Load("push", "shank", force=(300, 0, 20))],
        contacts=[Contact("foot", name="sole")],
        induced=["joints", "foot", "centre-of-mass"],
        induced_power=True,
    )


def test_a_torque_is_found_by_joint_link_cause_and_order(leg: Any) -> None:
    found = leg.to_xarray()
    at = {"joint": "knee_angle_r", "link": "foot"}
    by_cause = found.propagation.sel(**at, cause="hip_flexion_r")
    np.testing.assert_array_equal(
        by_cause.sel(order="velocity"), leg["tau_qd/knee_angle_r/foot/hip_flexion_r"]
    )
    np.testing.assert_array_equal(
        by_cause.sel(order="acceleration"), leg["tau_qdd/knee_angle_r/foot/hip_flexion_r"]
    )
    np.testing.assert_array_equal(found.time, leg.time)
    whole = found.propagation.sum(["cause", "order"]) + found.gravity
    np.testing.assert_allclose(whole, found.partial_torque, atol=1e-9)
    rest = found.partial_torque.sum("link") + found.load_torque.sum("load")
    np.testing.assert_allclose(rest, found.torque, atol=1e-9)


def test_every_column_is_an_entry_of_a_quantity(leg: Any) -> None:
    found = leg.to_xarray()
    over_time = [name for name in found.data_vars if "time" in found[name].dims]
    entries = {name: found[name].values.reshape(len(leg.time), -1) for name in over_time}
    there = {values.tobytes() for name in entries for values in entries[name].T}
    for column, values in zip(leg.columns[1:], leg.values[1:], strict=True):
        assert values.tobytes() in there, column.name
    for name in ("q", "qdd", "torque", "partial_torque", "load_torque", "power", "constraint_force"):
        np.testing.assert_array_equal(found[name], getattr(leg, name))
    for name in ("work", "joint_work", "load_work", "contact_work"):
        work = getattr(leg, name)
        np.testing.assert_array_equal(found[name].sel(way="given") - found[name].sel(way="taken"), work.net)


def test_units_are_those_of_the_columns(leg: Any) -> None:
    found = leg.to_xarray()
    written = str.maketrans({"·": " ", "²": None})
    units = {column.name: column.unit.replace("²", "^2").translate(written) for column in leg.columns}
    for joint in COORDINATES:
        torque = found.torque.sel(joint=joint)
        assert torque.coords[torque.units_from] == units[f"tau/{joint}"]
        qdd = found.qdd.sel(joint=joint)
        assert qdd.coords[qdd.units_from] == units[f"qdd/{joint}"]
    for row in found.constraint.values:
        force = found.constraint_force.sel(constraint=row)
        assert force.coords[force.units_from] == units[f"force/{row}"]
    for row in found.component.values:
        assert found.induced_units.sel(component=row).item() in {
            unit for name, unit in units.items() if name.startswith("acc/") and name.endswith(f"/{row}")
        }
    assert found.power.units == "W"


def test_shares_of_a_point_sum_to_its_acceleration_and_others_are_not_there(leg: Any) -> None:
    found = leg.to_xarray()
    shares = [name for name in found.data_vars if str(name).startswith("induced_")]
    whole = sum(found[n].sum([d for d in found[n].dims if d not in found.induced.dims]) for n in shares)
    there = found.induced.notnull()
    np.testing.assert_allclose(whole.where(there), found.induced, atol=1e-9)
    assert not there.sel(point="centre-of-mass", component="angular_x").any()
    assert there.sel(point="foot", component="angular_x").all()


def test_springs_and_losses_stand_alike_in_torques_and_in_accelerations(tmp_path: Path) -> None:
    """An armature is inertia, so that it accelerates nothing."""
    own = 'name = "knee_angle_r"\nstiffness = 3\ndamping = 20\narmature = 0.02\n'
    (tmp_path / "leg.toml").write_text(LEG.read_text().replace('name = "knee_angle_r"\n', own, 1))
    write_package(generate(read_system(tmp_path / "leg.toml"), ["numpy"]), tmp_path / "leg")
    log = write_csv(tmp_path / "walk.csv", smooth(40, 6) * [1, *[0.2] * 6], COORDINATES)
    result = analyze(log, tmp_path / "leg", induced=["joints", "foot"])
    found = result.to_xarray()
    assert list(found.source.values) == ["spring", "damping", "friction", "armature"]
    at = {"point": "joints", "component": "hip_flexion_r", "cause": "knee_angle_r"}
    for source in ("spring", "damping"):
        np.testing.assert_array_equal(
            found.induced_passive.sel(**at, source=source),
            result[f"acc_{source}/joints/hip_flexion_r/knee_angle_r"],
        )
    assert not found.induced_passive.sel(**at, source="armature").any()
    np.testing.assert_array_equal(
        found.passive_torque.sel(joint="knee_angle_r", source="armature"), result["tau_armature/knee_angle_r"]
    )


@pytest.fixture(scope="module")
def hostile(tmp_path_factory: pytest.TempPathFactory) -> Any:
    """An analysis of a robot whose names are any text."""
    folder, names = tmp_path_factory.mktemp("hostile"), HOSTILE[:7]
    (folder / "robot.toml").write_text(chain("<b>evil</b>", names), encoding="utf-8")
    write_package(generate(read_system(folder / "robot.toml"), ["numpy"]), folder / "evil")
    columns = [f"q{i}" for i in range(len(names))]
    log = write_csv(folder / "log.csv", smooth(40, len(names)), columns)
    return analyze(log, folder / "evil", Reading(mapping=tuple(zip(columns, names, strict=True))))


def test_files_give_back_what_was_saved(hostile: Any, leg: Any, tmp_path: Path) -> None:
    for number, analysis in enumerate((hostile, leg)):
        saved = analysis.to_xarray()
        saved.to_netcdf(tmp_path / f"{number}.nc", engine="h5netcdf")
        xr.testing.assert_identical(xr.load_dataset(tmp_path / f"{number}.nc", engine="h5netcdf"), saved)
        saved.to_zarr(tmp_path / f"{number}.zarr", consolidated=False)
        xr.testing.assert_identical(xr.open_zarr(tmp_path / f"{number}.zarr", consolidated=False), saved)


def test_pandas_and_polars_read_a_result_in_one_line(leg: Any, tmp_path: Path) -> None:
    pandas, polars = pytest.importorskip("pandas"), pytest.importorskip("polars")
    log = write_csv(tmp_path / "log.csv", smooth(40, 3))
    expected = analyze(log, PLANAR3).table
    names = list(expected)
    for kind in ("csv", "parquet"):
        command = [
            "analyze",
            log,
            "--robot",
            PLANAR3,
            "--out",
            tmp_path / kind,
            "--no-page",
            "--format",
            kind,
        ]
        assert CliRunner().invoke(app, list(map(str, command))).exit_code == 0
        file = tmp_path / kind / f"analysis.{kind}"
        for library in (pandas, polars):
            table = getattr(library, f"read_{kind}")(file)
            assert list(table.columns) == names
            np.testing.assert_array_equal(table.to_numpy(), np.stack(list(expected.values()), 1))
    assert pandas.DataFrame(leg.table).shape == polars.DataFrame(leg.table).shape == leg.values.T.shape
    frame = leg.to_xarray().partial_torque.to_dataframe()
    np.testing.assert_array_equal(
        frame.loc[(slice(None), "knee_angle_r", "foot"), "partial_torque"], leg["tau/knee_angle_r/foot"]
    )


class Shown(html.parser.HTMLParser):
    """Tags and text of a display."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.text = ""
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: Any) -> None:
        self.tags.add(tag)

    def handle_data(self, data: str) -> None:
        self.text += data + "\n"


def causes_of(result: Any, i: int) -> dict[str, float]:
    """Mean sizes of all that loads joint i, from the result's arrays; links together."""
    kinds = {"acceleration": result.acceleration, "velocity": result.velocity}
    moved = {kind: np.abs(terms[:, i].sum(axis=1)).mean(axis=0) for kind, terms in kinds.items()}
    return {
        "gravity": np.abs(result.gravity[:, i].sum(axis=1)).mean(),
        **{f"load {one.name}": size for one, size in zip(result.loads, load_sizes(result, i), strict=True)},
        **{f"{name} {kind}": moved[kind][k] for k, name in enumerate(COORDINATES) for kind in kinds},
    }


def load_sizes(result: Any, i: int) -> Any:
    return np.abs(result.load_torque[:, i]).mean(axis=0)


def test_a_notebook_shows_of_each_joint_the_largest_cause_loads_and_gravity_among_them(leg: Any) -> None:
    shown, largest = Shown(leg._repr_html_()).text, set()
    for i, joint in enumerate(COORDINATES):
        sizes = causes_of(leg, i)
        most = max(sizes, key=lambda name: sizes[name])
        whole = sum(sizes.values())
        unit = "N" if joint in ("pelvis_tx", "pelvis_ty") else "N·m"
        expected = [
            f"{joint} (residual)" if joint.startswith("pelvis") else joint,
            f"{np.abs(leg.torque[:, i]).max():.4g} {unit}",
            f"{np.abs(leg.torque[:, i]).mean():.4g} {unit}",
            *([most, f"{100 * sizes[most] / whole:.0f} %"] if whole else []),  # the ground bears the base
        ]
        assert "\n".join(expected) in shown
        largest.add(most)
    assert {"gravity", "load push"} <= largest
    assert leg.provenance in shown


def test_displays_hold_names_as_text_and_no_colour_of_their_own(hostile: Any, tmp_path: Path) -> None:
    (tmp_path / "robot.toml").write_text(chain("<b>evil</b>", HOSTILE[:7]), encoding="utf-8")
    robot = read_robot(tmp_path / "robot.toml")
    loaded = hostile.robot.package.module.load("numpy")
    systems = read_system("planar3", Options("symbolic")), read_system(DATA / "turntable.py")
    for one in (hostile, robot, robot.links[2], loaded, *systems):
        page = one._repr_html_()
        assert Shown(page).tags <= {"div", "p", "table", "tr", "th", "td", "br"}
        assert "color:" not in page.replace("border-color:color-mix", "")
        assert "\n" not in page


def test_what_is_missing_is_told(leg: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(
        LinkwiseError, match=r"no column 'tau/knee/foot'; nearest are 'tau/knee_angle_r/foot', "
    ):
        leg["tau/knee/foot"]
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(LinkwiseError, match=r"xarray is needed .* pip install 'linkwise\[names\]'"):
        leg.to_xarray()
