"""Whatever is deprecated says since when, until when and what to use, goes in time, and is in the changes."""

import ast
import re
import runpy
from collections.abc import Iterator
from pathlib import Path

import linkwise
import pytest
from linkwise_runtime.version import VERSION

ROOT = Path(__file__).parents[2]
FORM = re.compile(r"(\S+) is deprecated since (\d+)\.(\d+) and goes with (\d+)\.(\d+): use \S.*")
EXAMPLE = """from typing_extensions import deprecated


@deprecated("read_arm is deprecated since 0.3 and goes with 0.5: use read_robot")
def read_arm(path): ...
"""


def deprecations(folder: Path) -> Iterator[tuple[str, str]]:
    """Yield each text by which sources deprecate something, with its place; "" for one that is made up."""
    for path in sorted(folder.rglob("*.py")):
        nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
        calls = [node for node in nodes if isinstance(node, ast.Call) and deprecates(node)]
        texts: list[ast.expr] = [next(iter(call.args), call) for call in calls]
        texts += [node for node in nodes if isinstance(node, ast.Constant) and node not in texts]
        for text in texts:
            told = str(text.value) if isinstance(text, ast.Constant) else ""
            if text in texts[: len(calls)] or " is deprecated" in told:
                yield f"{path.relative_to(folder)}, line {text.lineno}", told


def deprecates(call: ast.Call) -> bool:
    """Return whether a call warns of a deprecation, or is the decorator that does."""
    name = ast.unparse(call.func).rpartition(".")[2]
    words = [ast.unparse(word) for word in (*call.args, *(given.value for given in call.keywords))]
    return name == "deprecated" or (name == "warn" and "DeprecationWarning" in words)


def faults(folder: Path, version: tuple[int, int], changes: str) -> list[str]:
    """Return what is wrong with the deprecations of a folder, at a version and with the changes' text."""
    found = []
    for place, text in deprecations(folder):
        if not (told := FORM.fullmatch(text)):
            found.append(f"{place}: write NAME is deprecated since 0.3 and goes with 0.5: use OTHER")
            continue
        name, (since, minor, until, last) = told[1], map(int, told.groups()[1:])
        if version >= (until, last):
            found.append(f"{place}: {name} goes with {until}.{last}, which is here: remove it")
        if (until, last) < ((since, minor + 2) if until == since else (since + 1, 1)):
            found.append(f"{place}: {name} is not in a minor version between")
        if f"`{name}`" not in changes:
            found.append(f"{place}: changes/ and CHANGELOG.md do not name `{name}`")
    return found


def test_all_that_is_deprecated_goes_by_the_rules() -> None:
    files = [ROOT / "CHANGELOG.md", *(ROOT / "changes").glob("*.deprecation.md")]
    changes = "\n".join(path.read_text(encoding="utf-8") for path in files)
    major, minor, _ = map(int, VERSION.split("."))
    assert not faults(ROOT / "generator", (major, minor), changes)


def test_what_is_public_is_told_on_one_page() -> None:
    page = (ROOT / "docs/api/linkwise.md").read_text(encoding="utf-8")
    told = set(re.findall(r"^\.\. auto\w+:: linkwise\.(\w+)$", page, re.MULTILINE))
    assert set(linkwise.__all__) - {"__version__"} == told


@pytest.fixture
def example(tmp_path: Path) -> Path:
    """A file with what the page shows."""
    page = (ROOT / "docs/deprecation.md").read_text(encoding="utf-8")
    assert EXAMPLE.partition("\n\n\n")[2] in page
    (tmp_path / "arms.py").write_text(EXAMPLE)
    return tmp_path


def test_the_example_warns_and_is_by_the_rules_until_its_time_is_over(example: Path) -> None:
    read_arm = runpy.run_path(str(example / "arms.py"))["read_arm"]
    with pytest.warns(DeprecationWarning, match=r"since 0\.3 and goes with 0\.5: use read_robot"):
        read_arm("arm.urdf")
    assert not faults(example, (0, 3), "- `read_arm` is")
    assert not faults(example, (0, 4), "- `read_arm` is")
    for later in ((0, 5), (1, 0)):
        [told] = faults(example, later, "- `read_arm` is")
        assert told == "arms.py, line 4: read_arm goes with 0.5, which is here: remove it"


def test_what_the_changes_do_not_name_is_told(example: Path) -> None:
    [told] = faults(example, (0, 3), "- `read_arms` is")
    assert told.endswith("do not name `read_arm`")


@pytest.mark.parametrize(
    ("since", "until", "enough"),
    [
        ("0.3", "0.4", False),
        ("0.3", "0.5", True),
        ("0.9", "1.0", False),
        ("0.9", "1.1", True),
        ("1.2", "1.1", False),
    ],
)
def test_one_minor_version_lies_between(since: str, until: str, enough: bool, tmp_path: Path) -> None:
    text = f"a is deprecated since {since} and goes with {until}: use b"
    (tmp_path / "a.py").write_text(f'warn("{text}", DeprecationWarning)')
    found = [told for told in faults(tmp_path, (0, 1), "`a`") if "between" in told]
    assert bool(found) is not enough


@pytest.mark.parametrize(
    "line",
    [
        'warn("a is old", DeprecationWarning)',
        'warnings.warn(f"{a} is deprecated since 0.3 and goes with 0.5: use b", DeprecationWarning)',
        "warn(message, category=DeprecationWarning)",
        '@deprecated("old")\ndef a(): ...',
        'tell("--arm is deprecated, use --robot")',
    ],
)
def test_another_form_is_told(line: str, tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(line)
    assert faults(tmp_path, (0, 3), "`a`")


def test_other_warnings_are_no_matter(tmp_path: Path) -> None:
    (tmp_path / "a.py").write_text(
        'warn("the arm is long", UserWarning)\nsimplefilter("ignore", DeprecationWarning)'
    )
    assert not faults(tmp_path, (0, 3), "")
