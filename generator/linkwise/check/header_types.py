"""Types that a package's header must declare: what its functions take beside arrays.

They are called in double alone, by the native back end: a member of another type or size would move all that
stand behind it, in float unseen.
"""

import re

from linkwise_runtime.native.library import MOST_TIED

from linkwise.package.manifest import Manifest

IMPEDANCE = """const {real} *keep_inertia; const {real} *inertia; const {real} *keep_velocity;
const {real} *damping; const {real} *stiffness; int regular;"""
FRICTION_WIDTH = " {real} friction_width;"
FRAME_IMPEDANCE = """int frame; const {real} *point; int rows; const int *row;
{real} keep_inertia, keep_velocity; const {real} *inertia, *damping, *stiffness;"""
OF_TIES = {
    "contact": "int kind; int frame; {real} point[3]; {real} axis[3]; {real} arm[3];",
    "constraints": """int contacts; const {name}_contact{suffix} *contact; int freedoms;
const int *independent; {real} tolerance; const {real} *weight;""",
    "actuators": "int driven; const int *joint; const {real} *weight; int undriven;",
    "grip": "int contact; {real} friction; {real} normal[3];",
}
CONTROLLER = """int (void *context, double time, size_t count, const {real} *q, const {real} *qd,
{real} *tau)"""
SIMULATION = """size_t instants; const double *time; double step; {name}_controller{suffix} *controller;
void *context; const {real} *tau; const {name}_constraints{suffix} *constraints; size_t *reached;"""
OF_LINKS = " int of_links;"


def header_types(manifest: Manifest) -> dict[str, str]:
    """Return members of each struct, or the type of a function, on one line, by the type's name in C."""
    is_rigid = manifest.tree is not None
    has_ties = is_rigid and len(manifest.joints) <= MOST_TIED
    told: dict[str, str] = {}
    if has_ties or not manifest.tied:
        told["impedance"] = IMPEDANCE + (FRICTION_WIDTH if manifest.passive else "")
        told |= {"frame_impedance": FRAME_IMPEDANCE} if is_rigid else {}
    if has_ties:
        simulation = SIMULATION + (OF_LINKS if manifest.passive else "")
        told |= {**OF_TIES, "controller": CONTROLLER, "simulation": simulation}
    return {
        f"{manifest.name}_{kind}{suffix}": _on_one_line(
            text.format(real=real, name=manifest.name, suffix=suffix)
        )
        for real, suffix in (("double", ""), ("float", "f"))
        for kind, text in told.items()
    }


def declared_types(header: str) -> dict[str, str]:
    """Return what a header declares, likewise."""
    code = re.sub(r'/\*.*?\*/|"[^"\n]*"', " ", header, flags=re.DOTALL)
    structs = re.findall(r"\btypedef struct \{(.*?)\} (\w+);", code, re.DOTALL)
    functions = re.findall(r"\btypedef (\w+) (\w+)(\(.*?\));", code, re.DOTALL)
    told = {name: _on_one_line(members) for members, name in structs}
    return told | {name: _on_one_line(f"{answer} {inputs}") for answer, name, inputs in functions}


def wrong_type(manifest: Manifest, header: str) -> str:
    """Return the first type unlike what functions need; empty if none."""
    expected, found = header_types(manifest), declared_types(header)
    wrong = sorted(name for name in expected.keys() | found.keys() if expected.get(name) != found.get(name))
    return f"the type {wrong[0]} is not declared as functions need it" if wrong else ""


def _on_one_line(text: str) -> str:
    return " ".join(text.split())
