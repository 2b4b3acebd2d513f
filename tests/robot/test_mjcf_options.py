"""Everything that MuJoCo can say about dynamics is modelled, refused or told: its torques decide which."""

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from linkwise import LinkwiseError, Options, generate, read_system, write_package
from linkwise.package.load import import_package
from linkwise.robot import effects
from linkwise.robot.readers.mjcf.forces import SWITCHED_OFF, SWITCHED_ON, switched_off
from linkwise.robot.readers.mjcf.reader import TYPES
from linkwise.robot.readers.mjcf.unmodelled import ACTING, ARRAYS, COUNTS

mujoco = pytest.importorskip("mujoco")

ARM = """<mujoco model="arm"><compiler angle="radian"/>{option}<worldbody>
  <body name="upper"><joint name="a" axis="0 1 0" {joint}/>
    <geom size="0.1" pos="0.1 0 0" mass="1" contype="0" conaffinity="0" {geom}/>
    <body name="lower" pos="0.3 0 0" {body}><joint name="b" axis="0 1 0.2"/>
      <geom size="0.1 0.2 0.1" type="box" pos="0.1 0 0.1" mass="1" contype="0" conaffinity="0"/>
      <site name="tip" pos="0.3 0 0"/></body></body>
  <site name="wall" pos="1 0 0.5"/></worldbody>{more}</mujoco>"""
FIXED = '<tendon><fixed name="t" {}><joint joint="a" coef="1"/><joint joint="b" coef="-1"/></fixed></tendon>'
SPATIAL = '<tendon><spatial name="t" {}><site site="wall"/><site site="tip"/></spatial></tendon>'
POST = '/><geom name="post" type="{}" size="0.1 1" pos="0.1 0 0" euler="1.57 0 0" mass="0" contype="0"'
AROUND = """<worldbody><site name="floor" pos="-1 0 -0.5"/></worldbody>
  <tendon><spatial name="t" stiffness="3"><site site="wall"/><geom geom="post"/><site site="floor"/></spatial>
  </tendon>"""
"""Tendon from world to world, and past a link by a shape of it alone."""
MOTOR = '<actuator><motor name="m" {}/></actuator>'
FLEX = """<worldbody><flexcomp name="cloth" type="grid" count="3 3 1" spacing="0.1 0.1 0.1" pos="2 0 0"
  mass="1" radius="0.01"><contact contype="0" conaffinity="0" selfcollide="none"/>
  <elasticity young="1e3" damping="0.1" thickness="0.01" elastic2d="stretch"/></flexcomp></worldbody>"""


def flag(**given: str) -> str:
    return f"<option><flag {' '.join(f'{k}={v!r}' for k, v in given.items())}/></option>"


APART = "apart from the links' torques, by passive_torque"
BOTH = flag(spring="disable", damper="disable")
CASES: dict[str, tuple[dict[str, str], str]] = {
    "nothing": ({}, ""),
    "gravity off": ({"option": flag(gravity="disable")}, ""),
    "damping": ({"joint": 'damping="0.5"'}, f"damping {APART}: a (0.5 N·m·s/rad)"),
    "damping, off": ({"joint": 'damping="0.5"', "option": flag(damper="disable")}, ""),
    "spring": (
        {"joint": 'stiffness="2" springref="0.1"'},
        f"spring {APART}: a (2 N·m/rad, at rest at 0.1 rad)",
    ),
    "spring, off": ({"joint": 'stiffness="2"', "option": flag(spring="disable")}, ""),
    "friction": ({"joint": 'frictionloss="0.4"'}, f"friction {APART}: a (0.4 N·m)"),
    "friction, off": ({"joint": 'frictionloss="0.4"', "option": flag(frictionloss="disable")}, ""),
    "friction, constraints off": ({"joint": 'frictionloss="0.4"', "option": flag(constraint="disable")}, ""),
    "armature": ({"joint": 'armature="0.3"'}, f"armature {APART}: a (0.3 kg·m²)"),
    "gravcomp": (
        {"body": 'gravcomp="0.5"'},
        "gravity compensation left out of the torques: lower (0.5 of its weight)",
    ),
    "gravcomp, gravity off": ({"body": 'gravcomp="0.5"', "option": flag(gravity="disable")}, ""),
    "gravcomp, passive forces off": ({"body": 'gravcomp="0.5"', "option": BOTH}, ""),
    "density": ({"option": '<option density="100"/>'}, "fluid left out of the torques: everywhere"),
    "viscosity": ({"option": '<option viscosity="1" wind="1 0 0"/>'}, "fluid left out of the torques: every"),
    "wind in nothing": ({"option": '<option wind="1 2 3" magnetic="1 1 1"/>'}, ""),
    "ellipsoid": (
        {"option": '<option density="9"/>', "geom": 'fluidshape="ellipsoid"'},
        "fluid left out of the torques",
    ),
    "fluid, passive forces off": ({"option": BOTH.replace("<option", '<option density="9"')}, ""),
    "fluid, springs off": (
        {"option": flag(spring="disable").replace("<option", '<option density="9"')},
        "fluid left out of the torques",
    ),
    "tendon": ({"more": FIXED.format("")}, ""),
    "tendon spring": (
        {"more": FIXED.format('stiffness="3"')},
        "tendon spring left out of the torques: t (3)",
    ),
    "spatial spring": ({"more": SPATIAL.format('stiffness="3"')}, "tendon spring left out of the torques: t"),
    **{
        f"spring around a {shape}": (
            {"geom": POST.format(shape), "more": AROUND},
            "tendon spring left out of the torques: t (3)",
        )
        for shape in ("sphere", "cylinder")
    },
    "tendon damping": (
        {"more": FIXED.format('damping="2"')},
        "tendon damping left out of the torques: t (2)",
    ),
    "tendon friction": ({"more": SPATIAL.format('frictionloss="2"')}, "tendon friction left out of the torq"),
    "tendon armature": ({"more": SPATIAL.format('armature="2"')}, "tendon armature left out of the torques"),
    "motor": ({"more": MOTOR.format('joint="a" gear="3"')}, ""),
    "servo": ({"more": '<actuator><position joint="a" kp="9" kv="2"/></actuator>'}, ""),
    "adhesion": ({"more": '<actuator><adhesion body="lower" ctrlrange="0 1"/></actuator>'}, ""),
    "keyframe": ({"more": '<keyframe><key qpos="1 1"/></keyframe>'}, ""),
    "cloth": ({"more": FLEX}, "flex spring left out of the torques: everywhere in the file"),
}
if tuple(map(int, mujoco.__version__.split(".")[:2])) >= (4, 0):
    CASES |= {
        "spring of higher order": (
            {"joint": 'stiffness="0 2 1"'},
            "spring left out of the torques: a (0 and",
        ),
        "damping of higher order": (
            {"joint": 'damping="0 2"'},
            "damping left out of the torques: a (0 and of",
        ),
        "rotor of a motor": (
            {"more": MOTOR.format('joint="a" armature="0.5"')},
            "armature left out of the tor",
        ),
        "drag of a motor": (
            {"more": MOTOR.format('joint="a" damping="0.5"')},
            "damping left out of the torq",
        ),
        "drag of a motor that is off": (
            {"more": MOTOR.format('joint="a" damping="0.5"'), "option": flag(actuation="disable")},
            "damping left out of the torques: m (0.5)",
        ),
        "rotor on a tendon": (
            {"more": FIXED.format("") + MOTOR.format('tendon="t" armature="0.5"')},
            "armature left out of the torques: m",
        ),
    }


def differing(path: Path, options: Options, folder: Path) -> float:
    """Largest part of MuJoCo's torques that linkwise's lack, on the joints a and b at rest of all else."""
    write_package(generate(read_system(path, options), ["numpy"]), folder / "arm")
    robot = import_package(folder / "arm").load("numpy")
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    data.qvel[:] = np.linspace(1.0, -2.0, model.nv)
    data.qacc[:] = np.linspace(3.0, 1.0, model.nv)
    data.qpos[:] += np.linspace(0.03, 0.05, model.nq)
    q, qd, qdd = data.qpos.copy(), data.qvel.copy(), data.qacc.copy()
    mujoco.mj_inverse(model, data)
    tau = robot.inverse_dynamics(q, qd, qdd) + robot.passive_torque(q, qd, qdd).total
    return float(np.abs(tau - data.qfrc_inverse).max() / np.abs(data.qfrc_inverse).max())


@pytest.mark.parametrize("case", CASES)
def test_what_is_told_is_what_the_torques_of_mujoco_have_beyond(case: str, tmp_path: Path) -> None:
    parts, told = CASES[case]
    path = tmp_path / "arm.xml"
    path.write_text(ARM.format(**({"option": "", "joint": "", "body": "", "geom": "", "more": ""} | parts)))
    (*lines,) = effects(read_system(path).robot.notes)
    error = differing(path, Options(), tmp_path)
    assert [line for line in lines if told and line.startswith(told)] == lines[: bool(told)]
    assert bool(lines) == bool(told)
    assert error > 1e-6 if told and APART not in told else error < 1e-12


@pytest.mark.parametrize(("what", "called"), [("damping", "damping"), ("stiffness", "spring")])
def test_what_a_ball_joint_takes_of_its_own_is_told_and_left_out(
    what: str, called: str, tmp_path: Path
) -> None:
    path = tmp_path / "arm.xml"
    text = ARM.format(option="", joint="", body="", geom="", more="")
    hinge = '<joint name="b" axis="0 1 0.2"/>'
    assert hinge in text
    path.write_text(text.replace(hinge, f'<joint name="b" type="ball" {what}="0.5"/>'))
    robot = read_system(path).robot
    told = f"{called} left out of the torques: b (0.5"
    assert [line for line in effects(robot.notes) if line.startswith(told)]
    assert not robot.passive


def test_gravity_compensation_by_actuators_is_part_of_what_they_must_give(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    text = ARM.format(option="", joint='actuatorgravcomp="true"', body='gravcomp="0.5"', geom="", more="")
    path.write_text(text.replace('name="b"', 'name="b" actuatorgravcomp="true"'))
    assert not effects(read_system(path).robot.notes)
    assert differing(path, Options(), tmp_path) < 1e-12


def test_nothing_is_told_of_a_joint_that_is_held_or_cut_off(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    spring = FIXED.format('stiffness="3"').replace('<joint joint="b" coef="-1"/>', "")
    path.write_text(ARM.format(option="", joint='damping="1"', body='gravcomp="1"', geom="", more=spring))
    held = effects(read_system(path, Options(lock={"a": 0.0})).robot.notes)
    assert [line.partition(":")[0] for line in held] == ["gravity compensation left out of the torques"]
    cut = effects(read_system(path, Options(root="upper")).robot.notes)
    assert [line.partition(":")[0] for line in cut] == ["gravity compensation left out of the torques"]
    left = effects(read_system(path, Options(tip="upper")).robot.notes)
    assert "gravity compensation left out of the torques" not in [line.partition(":")[0] for line in left]


def test_accelerations_as_differences_are_told(tmp_path: Path) -> None:
    path = tmp_path / "arm.xml"
    option = flag(invdiscrete="enable")
    path.write_text(ARM.format(option=option, joint="", body="", geom="", more=""))
    (line,) = effects(read_system(path).robot.notes)
    assert line == "differences in place of accelerations left out of the torques: by a flag of <option>"


@pytest.mark.parametrize(
    ("bits", "table"), [(mujoco.mjtDisableBit, SWITCHED_OFF), (mujoco.mjtEnableBit, SWITCHED_ON)]
)
def test_every_flag_of_mujoco_has_its_meaning(bits: Any, table: dict[str, Any]) -> None:
    flags = {name.partition("_")[2] for name in bits.__members__ if "_" in name}
    assert flags <= set(table)


def test_every_type_of_joint_is_known() -> None:
    names = [name.partition("_")[2].lower() for name in mujoco.mjtJoint.__members__]
    assert names == ["free", "ball", "slide", "hinge"]
    assert TYPES == ("floating", "ball", "prismatic", "revolute")


def test_flag_that_is_unknown_is_refused_where_it_is_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(SWITCHED_OFF, "GRAVITY")
    weightless = mujoco.MjModel.from_xml_string(f"<mujoco>{flag(gravity='disable')}</mujoco>")
    with pytest.raises(
        LinkwiseError, match="<option> changes the flag 'gravity', which this version of linkw"
    ):
        switched_off(mujoco, weightless)
    assert not switched_off(mujoco, mujoco.MjModel.from_xml_string("<mujoco/>"))


READ = """
    body_parentid body_jntnum body_jntadr body_mass body_pos body_quat body_ipos body_iquat body_inertia
    jnt_type jnt_qposadr jnt_dofadr jnt_bodyid jnt_pos jnt_axis jnt_actgravcomp qpos0 opt gravity
    disableflags enableflags eq_type eq_obj1id eq_obj2id eq_objtype eq_active0 site_bodyid geom_bodyid
    tendon_adr tendon_num wrap_type wrap_objid names actuator_trntype actuator_trnid
"""
"""Fields that are read to build the robot, or to find what a force acts on."""

DERIVED = """
    body_rootid body_weldid body_mocapid body_dofnum body_dofadr body_treeid body_simple body_sameframe
    body_subtreemass body_invweight0 body_geomnum body_geomadr body_bvhadr body_bvhnum body_plugin
    jnt_actuatorid dof_bodyid dof_jntid dof_parentid dof_treeid dof_Madr dof_simplenum dof_invweight0 dof_M0
    dof_length tendon_treenum tendon_treeid tendon_length0 tendon_invweight0 tendon_actuatorid actuator_acc0
    actuator_length0 actuator_lengthrange flexedge_length0 flexedge_invweight0 flexedge_J_rownnz
    flexedge_J_rowadr flexedge_J_colind flex_vert0 flex_node0 flex_size ten_J_rownnz ten_J_rowadr
    ten_J_colind stat signature
"""
"""Fields that MuJoCo computes from other ones, and sizes and addresses."""

NO_FORCE_OF_ITS_OWN = """
    body_user jnt_user jnt_group qpos_spring jnt_springyield jnt_plasticadr tendon_springyield
    tendon_plasticadr tendon_lengthspring jnt_actfrclimited jnt_actfrcrange tendon_actfrclimited
    tendon_actfrcrange geom_fluid wind magnetic wrap_prm disableactuator flg_gravcomp
"""
"""Fields of a force that is told wherever its own field is not zero: a spring's rest, the medium's wind."""

CONTACTS_AND_LIMITS = """
    body_margin body_contype body_conaffinity jnt_solref jnt_solimp jnt_range jnt_margin dof_solref
    dof_solimp eq_solref eq_solimp eq_data tendon_limited tendon_solref_lim tendon_solimp_lim
    tendon_solref_fri tendon_solimp_fri tendon_range tendon_margin flg_surfacevel flg_adhesion
"""
"""The torques are of a robot that touches nothing, within its limits; active equalities are refused."""

SIMULATION = """
    timestep impratio tolerance ls_tolerance noslip_tolerance ccd_tolerance sleep_tolerance o_margin
    o_solref o_solimp o_friction integrator cone jacobian solver iterations ls_iterations noslip_iterations
    ccd_iterations sdf_initpoints sdf_iterations tree_bodyadr tree_bodynum tree_dofadr tree_dofnum
    tree_sleep_policy
"""
"""Fields by which a simulation goes from step to step."""

ACTUATORS = """
    actuator_acc0 actuator_actadr actuator_actearly actuator_actlimited actuator_actnum actuator_actrange
    actuator_biasprm actuator_biastype actuator_cranklength actuator_ctrladr actuator_ctrllimited
    actuator_ctrlnum actuator_ctrlrange actuator_ctrlspec actuator_delay actuator_dynprm actuator_dyntype
    actuator_forcelimited actuator_forcerange actuator_gainprm actuator_gaintype actuator_gear
    actuator_group actuator_history actuator_historyadr actuator_length0 actuator_lengthrange
    actuator_outadr actuator_outnum actuator_plugin actuator_user
"""
"""The force that a motor gives for a command: the torques are what it must give."""

FLEXES = """
    flex_activelayers flex_bendingadr flex_bvhadr flex_bvhnum flex_cellnum flex_centered flex_conaffinity
    flex_condim flex_contype flex_dim flex_edge flex_edgeadr flex_edgeequality flex_edgeflap flex_edgenum
    flex_elem flex_elemadr flex_elemdataadr flex_elemedge flex_elemedgeadr flex_elemlayer flex_elemnum
    flex_elemtexcoord flex_flatskin flex_friction flex_gap flex_group flex_interp flex_margin flex_matid
    flex_node flex_node0 flex_nodeadr flex_nodebodyid flex_nodenum flex_passive flex_plasticadr
    flex_plasticmode flex_priority flex_radius flex_rgba flex_rigid flex_selfcollide flex_shell
    flex_shelldataadr flex_shellnum flex_size flex_solimp flex_solmix flex_solref flex_stiffnessadr
    flex_texcoord flex_texcoordadr flex_vert flex_vert0 flex_vertadr flex_vertbodyid flex_vertcell
    flex_vertnum flex_yield flexedge_J_colind flexedge_J_rowadr flexedge_J_rownnz flexedge_invweight0
    flexedge_length0 flexedge_rigid
"""
"""Fields of the vertices of a flex and what they touch; its bodies are bodies like others."""

GEOMS = """
    geom_aabb geom_adhesion geom_castshadow geom_conaffinity geom_condim geom_contype geom_dataid
    geom_friction geom_gap geom_group geom_margin geom_matid geom_plugin geom_pos geom_priority geom_quat
    geom_rbound geom_rgba geom_sameframe geom_size geom_solimp geom_solmix geom_solref geom_surfacevel
    geom_type geom_user pair_adhesion pair_dim pair_friction pair_gap pair_geom1 pair_geom2 pair_margin
    pair_signature pair_solimp pair_solref pair_solreffriction
"""
"""Shapes and contacts; masses and inertias are the bodies'."""

KINDS = """
    site cam light mesh skin hfield tex mat exclude sensor numeric text tuple key name bvh oct plugin B M D
    mapM2M mapM2D mapD2M efm0 efmC paths names_map vis tendon_rgba tendon_width tendon_matid tendon_group
    tendon_user tendon_type
"""
"""Beginnings of fields without a part in the dynamics of bodies."""


def fields_of(struct: Any) -> set[str]:
    """Names of a struct's fields, the aliases of Python's named access left out."""
    return {
        name
        for name in dir(struct)
        if not name.startswith("_") and not callable(getattr(struct, name)) and name != "buffer"
    }


def test_every_field_of_a_compiled_model_is_accounted_for() -> None:
    model = mujoco.MjModel.from_xml_string("<mujoco/>")
    told = {name for row in ACTING for name in row.fields} | {*COUNTS.values(), *ARRAYS.values()}
    without = READ, DERIVED, NO_FORCE_OF_ITS_OWN, CONTACTS_AND_LIMITS, SIMULATION, ACTUATORS, FLEXES, GEOMS
    known = told | set(" ".join(without).split())
    kinds = tuple(KINDS.split())
    left = {
        name
        for name in fields_of(model) | fields_of(model.opt)
        if name not in known
        and name not in kinds
        and not any(name.startswith(f"{kind}_") for kind in kinds)
        and not re.fullmatch("n[a-zA-Z0-9]+(_[a-z]+)?", name)  # sizes
    }
    assert not left


def test_warning_of_mujoco_is_told_and_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "nan.mjcf"
    path.write_text('<mujoco><worldbody><body><joint/><geom size="nan"/></body></worldbody></mujoco>')
    with pytest.raises(LinkwiseError, match=r"nan size in geom.*; XML contains a 'NaN'") as caught:
        read_system(path)
    assert "MuJoCo cannot compile it: " in str(caught.value)
    text = '<mujoco><worldbody><body><joint solreflimit="nan 1"/><geom size="1"/></body></worldbody></mujoco>'
    path.write_text(text)
    (line,) = effects(read_system(path).robot.notes)
    assert line == "MuJoCo warns: XML contains a 'NaN'. Please check it carefully."
    assert [file.name for file in tmp_path.iterdir()] == ["nan.mjcf"]
