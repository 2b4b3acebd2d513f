"""A manifest's entries: what of them is refused, and that `check` holds every one."""

import hashlib
import json
import shutil
from collections.abc import Callable, Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from conftest import DATA
from linkwise import LinkwiseError, check_package, generate, read_system, write_package
from linkwise.package.manifest import LARGEST, SCHEMA, Manifest
from linkwise.package.write import check_target


@pytest.fixture(scope="session")
def planar2(tmp_path_factory: pytest.TempPathFactory) -> Path:
    directory = tmp_path_factory.mktemp("manifest") / "planar2"
    write_package(generate(read_system("planar2"), ["numpy"]), directory)
    return directory


@pytest.fixture
def package(planar2: Path, tmp_path: Path) -> Path:
    """A package of one's own to damage."""
    return shutil.copytree(planar2, tmp_path / "planar2")


def change_manifest(package: Path, change: Callable[[Any], object], checksums: bool = False) -> None:
    """Change what a manifest says, and its checksums as if linkwise had said so."""
    path = package / "manifest.json"
    data = json.loads(path.read_text())
    change(data)
    if checksums:
        for key in data["checksums"]:
            text = json.dumps(data[key], sort_keys=True)
            data["checksums"][key] = hashlib.sha256(text.encode()).hexdigest()
    path.write_text(json.dumps(data))


def joints(data: Any) -> Any:
    return data["tree"]["joints"]


def links(data: Any) -> Any:
    return data["tree"]["links"]


NOTHING_BESIDE: dict[str, Any] = {
    "time": "",
    "inputs": [],
    "constraints": [],
    "independent": [],
    "closed_position": [],
}
TIE = {"name": "loop", "kind": "point", "first": 0, "second": 1, "length": 0.0}

DAMAGES: dict[str, tuple[Callable[[Any], object], str]] = {
    **{
        key: (lambda data, key=key: data.pop(key), f"the whole is not an object with {key}")  # type: ignore[misc]
        for key in ("joints", "links", "tree", "request", "files")
    },
    "no joints": (lambda data: data.update(joints=[]), "there must be a joint and a link"),
    "joint": (lambda data: data["joints"].append(3), "joints[2] is not an object"),
    "name": (lambda data: data.update(name=""), "name is '', which no module can be called"),
    "path": (lambda data: data["links"][0].update(path=[7]), "the path of link 'link1' names a joint"),
    "path of words": (lambda data: data["links"][0].update(path="ab"), "links[0].path is not a list"),
    "request": (lambda data: data.update(request=3), "request is not an object"),
    "gravity": (lambda data: data["tree"].pop("gravity"), "tree is not an object with gravity"),
    "tree of words": (lambda data: data.update(tree="ab"), "tree is not an object"),
    "joint of the tree that is none": (
        lambda data: joints(data).append(None),
        "tree.joints[2] is not an object",
    ),
    "mass": (lambda data: links(data)[0].update(mass="a"), "tree.links[0].mass is not a finite number"),
    "nan": (
        lambda data: links(data)[1].update(com=[float("nan"), 0, 0]),
        "tree.links[1].com[0] is not a finite number",
    ),
    "rotation": (
        lambda data: joints(data)[1].update(rotation=[[1]]),
        "tree.joints[1].rotation is not a list of 3",
    ),
    "coordinate": (lambda data: joints(data)[1].update(coordinate=2), "tree.joints[1].coordinate is not"),
    "kind": (lambda data: joints(data)[1].update(kind=[]), "tree.joints[1].kind is not 'revolute' or"),
    "parent": (
        lambda data: joints(data)[1].update(parent=1),
        "tree.joints[1].parent is not an earlier joint",
    ),
    "link": (
        lambda data: joints(data)[1].update(link="hand"),
        "links[1].name is 'link2', and its joint in the tree moves 'hand'",
    ),
    "link left out": (lambda data: links(data).pop(), "tree.links has 1 links, links 2"),
    "link on no joint": (lambda data: links(data)[1].update(joint=2), "tree.links[1].joint is not there"),
    "turned link": (
        lambda data: data["links"][1].update(path=[1]),
        "the path of link 'link2' is not that of the tree",
    ),
    "passive entry": (
        lambda data: data["passive"].append(
            {"joint": "joint1", "coordinate": 1, "ratio": 1.0}
            | dict.fromkeys(("stiffness", "rest", "damping", "friction", "armature"), 0.5)
        ),
        "passive[0] is not of a joint that moves so in the tree",
    ),
    "joint of the tree": (
        lambda data: joints(data)[1].update(name="wrist"),
        "joints[1].name is 'joint2', which no joint of the tree with it has",
    ),
    "unit": (
        lambda data: data["joints"][0].update(unit="m"),
        "joints[0].unit is 'm', which is not that of its kind in the tree",
    ),
    "sheared": (
        lambda data: joints(data)[1].update(rotation=[[1, 0, 0], [0, 1, 0.1], [0, 0, 1]]),
        "tree.joints[1].rotation is not a rotation",
    ),
    "mirrored": (
        lambda data: joints(data)[1].update(rotation=[[1, 0, 0], [0, 1, 0], [0, 0, -1]]),
        "tree.joints[1].rotation is not a rotation",
    ),
    "inertia": (
        lambda data: links(data)[1].update(inertia=[[1, 0, 0], [0, 1, 0.1], [0, 0, 1]]),
        "tree.links[1].inertia is not symmetric",
    ),
    "frame twice": (
        lambda data: data["tree"]["frames"][1].update(name=data["tree"]["frames"][0]["name"]),
        "tree.frames has 'base' twice",
    ),
    "frame on nothing": (
        lambda data: data["tree"]["frames"][0].update(joint=2),
        "tree.frames[0].joint is not there",
    ),
    "mirrored frame": (
        lambda data: data["tree"]["frames"][0].update(rotation=[[1, 0, 0], [0, 1, 0], [0, 0, -1]]),
        "tree.frames[0].rotation is not a rotation",
    ),
    "frame of a link": (
        lambda data: data["tree"]["frames"][2].update(joint=0),
        "tree.frames has no frame 'link2' on the joint of that link",
    ),
    "formula of no frame": (
        lambda data: data["formulas"].update({"frames[9].translation[0]": "m"}),
        "formulas has 'frames[9].translation[0]', which is not a place of the tree",
    ),
    "joint twice": (
        lambda data: data["joints"][1].update(name="joint1"),
        "joints has 'joint1' twice",
    ),
    "neither bodies nor energies": (lambda data: data.update(tree=None), "there must be either a tree or"),
    "energies of other links": (
        lambda data: data.update(tree=None, energies={"links": [], **NOTHING_BESIDE}),
        "energies is not of the links, one for each",
    ),
    "formula of nothing": (
        lambda data: data["formulas"].update({"links[2].mass": "m"}),
        "formulas has 'links[2].mass', which is not a place of the tree",
    ),
    "formula of a rotation": (
        lambda data: data["formulas"].update({"joints[0].rotation[0][0]": "m"}),
        "formulas has 'joints[0].rotation[0][0]', which is not a place",
    ),
    "tie of an unknown kind": (
        lambda data: data["tree"]["ties"].append(TIE | {"kind": "weld"}),
        "tree.ties[0].kind is not 'point' or 'hinge' or 'frame' or 'distance'",
    ),
    "tie of no frame": (
        lambda data: data["tree"]["ties"].append(TIE | {"second": 9}),
        "the tie 'loop' of the tree is not between two of its frames",
    ),
    "tie of one frame": (
        lambda data: data["tree"]["ties"].append(TIE | {"second": 0}),
        "the tie 'loop' of the tree is not between two of its frames",
    ),
    "length of a point": (
        lambda data: data["tree"]["ties"].append(TIE | {"length": 0.1}),
        "the tie 'loop' of the tree has a length that it cannot have",
    ),
    "distance of zero": (
        lambda data: data["tree"]["ties"].append(TIE | {"kind": "distance"}),
        "the tie 'loop' of the tree has a length that it cannot have",
    ),
    "tie twice": (
        lambda data: data["tree"]["ties"].extend([TIE, TIE]),
        "tree.ties and tree.couplings have 'loop' twice",
    ),
    "coupling of no joint": (
        lambda data: data["tree"]["couplings"].append({"name": "gear", "terms": [[2, [0, 1]]]}),
        "the coupling 'gear' of the tree has a joint that is not there",
    ),
    "coupling of a constant": (
        lambda data: data["tree"]["couplings"].append({"name": "gear", "terms": [[0, [0, 1]], [1, [1]]]}),
        "the coupling 'gear' of the tree does not couple joints in order",
    ),
    "coupling of one joint twice": (
        lambda data: data["tree"]["couplings"].append({"name": "gear", "terms": [[0, [0, 1]], [0, [0, 1]]]}),
        "the coupling 'gear' of the tree does not couple joints in order",
    ),
    "independent of nothing": (
        lambda data: data["tree"].update(independent=[0]),
        "tree.independent is not of some joints where there are constraints, else of none",
    ),
    "all independent": (
        lambda data: data["tree"].update(ties=[TIE], independent=[0, 1]),
        "tree.independent is not of some joints where there are constraints, else of none",
    ),
    "closed position of nothing": (
        lambda data: data["tree"].update(closed_position=[0.5, 0.0]),
        "tree.closed_position is not of all joints where there are constraints, else of none",
    ),
    "independent of no joint": (
        lambda data: data["tree"].update(ties=[TIE], independent=[2]),
        "tree.independent is not of joints, in ascending order",
    ),
    "link twice": (lambda data: data["links"][1].update(name="link1"), "links has 'link1' twice"),
}


@pytest.mark.parametrize("case", DAMAGES)
def test_a_damaged_manifest_is_named(case: str, package: Path) -> None:
    change, message = DAMAGES[case]
    change_manifest(package, change)
    with pytest.raises(LinkwiseError) as caught:
        check_package(package)
    assert str(caught.value).startswith(f"{package / 'manifest.json'} is damaged: {message}")
    assert str(caught.value).endswith("; generate the robot again")


@pytest.mark.parametrize("robot", ["torso", str(DATA / "fourbar.toml"), f"{DATA / 'knee.osim'} loops"])
def test_a_package_and_its_manifest_have_the_same_tree(
    robot: str, directory_of: Callable[[str], Path], package_of: Callable[[str], ModuleType]
) -> None:
    tree = import_module(f"{package_of(robot).__name__}.tree")
    assert Manifest.read(directory_of(robot)).tree == tree.TREE


def test_a_manifest_of_another_version_is_told_apart_from_a_damaged_one(package: Path) -> None:
    change_manifest(package, lambda data: data.update(schema=1))
    with pytest.raises(
        LinkwiseError, match=rf"another version of linkwise \(schema 1, this one reads {SCHEMA}\)"
    ):
        check_package(package)


def leaves(data: Any, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    """Yield the places where the manifest has a number, a string, null, true or false; of a list's items the
    last."""
    inner = (
        data.items()
        if isinstance(data, dict)
        else list(enumerate(data))[-1:]
        if isinstance(data, list)
        else []
    )
    for key, value in inner:
        yield from leaves(value, (*path, key))
    if not isinstance(data, (dict, list)):
        yield path


def another(value: Any) -> Any:
    if isinstance(value, str):
        return {"rad": "m", "revolute": "prismatic"}.get(value, f"{value} too")
    return 1 if value is None else value + 1


def complaint(package: Path) -> str:
    """Return what `check` says of a manifest."""
    try:
        [wrong] = [result for result in check_package(package, 1)[:3] if result.failed]
    except LinkwiseError as error:
        return str(error).removeprefix(str(package / "manifest.json"))
    assert wrong.name == "manifest"
    return wrong.detail


def test_every_entry_is_held_by_name(package: Path) -> None:
    text = (package / "manifest.json").read_text()
    held = [path for path in leaves(json.loads(text)) if path[0] not in ("files", "checksums")]
    assert len(held) > 35
    for path in held:

        def change(data: Any, path: tuple[str | int, ...] = path) -> None:
            for key in path[:-1]:
                data = data[key]
            data[path[-1]] = another(data[path[-1]])

        (package / "manifest.json").write_text(text)
        change_manifest(package, change)
        assert any(str(key) in complaint(package) for key in path), (path, complaint(package))


def as_energies(data: Any) -> None:
    """A manifest of energies that a user wrote in place of bodies."""
    rows = [{"link": link["name"], "kinetic": "0", "degree": 2, "shares": []} for link in data["links"]]
    data.update(tree=None, energies={"links": rows, **NOTHING_BESIDE})


SLIPS: dict[str, tuple[Callable[[Any], object], str]] = {
    "name": (lambda d: d.update(name="arm"), "name 'arm', the package 'planar2'"),
    "version": (lambda d: d["generator"].update(linkwise="9"), "generator.linkwise '9', the package '"),
    "joint": (lambda d: d["joints"].append(d["joints"][0] | {"name": "wrist"}), ""),
    "operations": (lambda d: d["links"][1].update(operations=46), "links[1].operations 46, the package 40"),
    "parameter": (lambda d: d.update(parameters={"m": 1.0}), "parameters.m 1.0, the package not at all"),
    "back ends": (lambda d: d["request"].update(backends=["c"]), "request.backends {'c'}, the package {'"),
    "energies": (
        lambda d: (as_energies(d), d["links"][1].update(path=[1])),
        "links[1].path (1,), the package (0, 1)",
    ),
    "link": (
        lambda d: (d["links"][0].update(name="hand"), as_energies(d)),
        "links[0].name 'hand', the package 'link1'",
    ),
    "unit": (
        lambda d: (as_energies(d), d["joints"][0].update(unit="m")),
        "joints[0].unit 'm', the package 'rad'",
    ),
}


@pytest.mark.parametrize("case", SLIPS)
def test_an_entry_that_the_package_has_otherwise_fails(case: str, package: Path) -> None:
    change, message = SLIPS[case]
    change_manifest(package, change, checksums=True)
    if not message:
        with pytest.raises(LinkwiseError, match=r"joints\[2\].name is 'wrist', which no joint"):
            check_package(package)
        return
    *_, result = check_package(package)
    assert (result.name, result.mark) == ("manifest", "FAIL")
    assert result.detail.startswith(f"manifest.json has {message}")


NUMBERED = f'"schema": {SCHEMA}'
TEXTS: dict[str, tuple[Callable[[str], str], str]] = {
    "digits": (
        lambda t: t.replace('"mass": 0.6', f'"mass": {"9" * 400}'),
        "tree.links[0].mass is not a finite",
    ),
    "count": (
        lambda t: t.replace('"operations": 3', f'"operations": {"9" * 5000}'),
        "links[0].operations is not a whole",
    ),
    "power": (lambda t: t.replace('"mass": 0.6', '"mass": 1e999'), "tree.links[0].mass is not a finite"),
    "below 0": (
        lambda t: t.replace('"operations": 3', '"operations": -3'),
        "links[0].operations is not a whole",
    ),
    "infinity": (
        lambda t: t.replace('"root": null', '"root": -Infinity'),
        "request.root is not a finite number",
    ),
    "twice": (lambda t: t.replace('"lock": {}', '"lock": {}, "lock": {}'), "the entry 'lock' is there twice"),
    "depth": (lambda t: t.replace('"lock": {}', f'"lock": {"[" * 100_000}'), "nested too deeply"),
    "objects": (
        lambda t: t.replace('"lock": {}', '"lock": {"a": {"b": {}}}'),
        "request.lock.a is not a number, a",
    ),
    "long name": (
        lambda t: t.replace('"lock": {}', f'"lock": {{"{"a" * 200}": {{"b": {{}}}}}}'),
        f"request.lock.'{'a' * 80}' is not a number",
    ),
    "surrogate": (
        lambda t: t.replace('"robot": "planar2"', '"robot": "\\ud800"', 1),
        "robot is not a string of whole",
    ),
    "list": (lambda t: "[]", "the whole is not an object"),
    "nothing": (lambda t: "", "Expecting value"),
    "schema": (lambda t: t.replace(NUMBERED, '"schema": "3"'), f"schema is not the number {SCHEMA}"),
    "truth": (lambda t: t.replace(NUMBERED, '"schema": true'), f"schema is not the number {SCHEMA}"),
    "no schema": (lambda t: t.replace(f"{NUMBERED},", ""), f"schema is not the number {SCHEMA}"),
    "unknown": (
        lambda t: t.replace('"lock": {}', '"lock": {}},"more": {"a": 1'),
        "more is not a known entry",
    ),
    "unknown inside": (
        lambda t: t.replace('"unit": "rad"', '"unit": "rad", "a\\n": 1', 1),
        "joints[0].'a\\n' is not a known",
    ),
}


@pytest.mark.parametrize("case", TEXTS)
def test_a_manifest_that_is_not_one_is_named_in_a_line(case: str, package: Path) -> None:
    change, message = TEXTS[case]
    path = package / "manifest.json"
    text = change(path.read_text())
    assert text != path.read_text()
    path.write_text(text)
    with pytest.raises(LinkwiseError) as caught:
        check_package(package)
    assert str(caught.value).startswith(f"{path} is damaged: {message}")
    assert len(str(caught.value)) < 300
    assert "\n" not in str(caught.value)


def test_a_manifest_too_large_to_be_one_is_not_read(package: Path) -> None:
    with (package / "manifest.json").open("r+b") as file:
        file.truncate(LARGEST + 1)
    with pytest.raises(LinkwiseError, match=f"the file of {LARGEST + 1} bytes is not a manifest"):
        check_package(package)


@pytest.mark.parametrize(
    "path", ["/etc/passwd", "../other.py", "forms/../names.py", "a//b", "", ".", "a\\b", "manifest.json"]
)
def test_a_path_that_leads_out_of_the_package_is_refused(path: str, package: Path) -> None:
    change_manifest(package, lambda data: data["files"].update({path: "0" * 64}))
    with pytest.raises(LinkwiseError) as caught:
        Manifest.read(package)
    assert f"damaged: files has {path!a}, which is not a path of a file in the package" in str(caught.value)


def test_what_is_not_a_hash_is_refused(package: Path) -> None:
    change_manifest(package, lambda data: data["files"].update({"names.py": "0"}))
    with pytest.raises(LinkwiseError, match=r"files has for 'names.py' something else than a SHA-256"):
        Manifest.read(package)


@pytest.mark.parametrize(
    "data",
    [
        {"files": {}},
        {"files": {}, "generator": {"vite": "5"}},
        {"files": {}, "generator": "linkwise"},
        {"files": ["a"], "generator": {"linkwise": "1"}},
        {"generator": {"linkwise": "1"}},
    ],
    ids=str,
)
def test_a_folder_with_the_manifest_of_another_program_is_not_replaced(data: Any, tmp_path: Path) -> None:
    (tmp_path / "manifest.json").write_text(json.dumps(data))
    with pytest.raises(LinkwiseError, match="exists and is not a generated package"):
        check_target(tmp_path, "planar2")


def test_a_new_back_end_may_put_its_files_several_folders_down(tmp_path: Path) -> None:
    files = {"manifest.json": json.dumps({"robot": "arm"}), "rust/src/lib.rs": "// τ\n"}
    write_package(files, tmp_path / "arm")
    assert (tmp_path / "arm/rust/src/lib.rs").read_text(encoding="utf-8") == "// τ\n"
