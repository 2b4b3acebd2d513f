"""A package's text is read before it runs: a foreign call is refused, whatever its hash says."""

import hashlib
import json
import shutil
import warnings
from collections.abc import Callable
from pathlib import Path

import pytest
from conftest import DATA
from linkwise import LinkwiseError, Options, check_package, generate, read_system, write_package
from linkwise.errors import LinkwiseWarning
from linkwise.expression.expression_graph import FUNCTIONS as OF_GRAPHS
from linkwise.package.emitted_c import FUNCTIONS
from linkwise.package.emitted_text import Source, foreign_text
from linkwise.package.load import open_package
from linkwise.package.manifest import FILE
from linkwise_runtime.version import VERSION

FOREIGN: dict[str, tuple[str, str, str, str]] = {
    "a call in closed forms": (
        "forms/link_1.py",
        "    # inputs\n",
        "    open({mark!r}, 'w')\n    # inputs\n",
        "names open",
    ),
    "an import in closed forms": (
        "forms/link_1.py",
        "from typing import Any",
        "from typing import Any\nfrom os import system as xp",
        "imports system from os",
    ),
    "a library under another name": (
        "forms/link_1.py",
        "from typing import Any",
        "from typing import Any\nimport os as np",
        "imports os",
    ),
    "an attribute of what is given": (
        "forms/link_1.py",
        "    # inputs\n",
        "    q.tofile({mark!r})\n    # inputs\n",
        "asks for .tofile",
    ),
    "a function of the library that reads": (
        "forms/link_1.py",
        "    # inputs\n",
        "    xp.load({mark!r})\n    # inputs\n",
        "asks for .load",
    ),
    "what a class hides": (
        "forms/link_1.py",
        "    # inputs\n",
        "    ().__class__\n    # inputs\n",
        "asks for .__class__",
    ),
    "a decorator": (
        "energies/link_1.py",
        "    def kinetic(",
        "    @exec\n    def kinetic(",
        "names exec",
    ),
    "a part of the runtime that runs programs": (
        "energies/link_1.py",
        "from typing import Any",
        "from typing import Any\nfrom linkwise_runtime.native.process import run_all",
        "imports run_all from linkwise_runtime.native.process",
    ),
    "a call between names": ("names.py", "ROBOT = ", "print()\nROBOT = ", "names print"),
    "a comprehension in the tree": ("tree.py", "TREE = ", "[0 for TREE in ()]\nTREE = ", "has ListComp"),
    "another folder of C": (
        "__init__.py",
        'Path(__file__).parent / "c"',
        'Path(__file__).parent / "../c"',
        "does what is no arithmetic",
    ),
    "a folder of C that leads elsewhere": (
        "__init__.py",
        'Path(__file__).parent / "c"',
        'Path(__file__).parent / "c" / "../../evil"',
        "does what is no arithmetic",
    ),
    "a type that is made": (
        "names.py",
        "ROBOT = ",
        'MADE = type("Name", (str,), {})\nROBOT = ',
        "calls type",
    ),
    "a class of another kind": (
        "energies/link_1.py",
        "class ",
        "class Kind(metaclass=carried):\n    place = 1\n\n\nclass ",
        "has a class of another kind",
    ),
    "a product of a list": (
        "names.py",
        "ROBOT = ",
        "MANY = (1.0,) * 10\nROBOT = ",
        "does what is no arithmetic",
    ),
    "more signs than Python reads": (
        "names.py",
        "ROBOT = ",
        f"SIGNS = {'-' * 30_000}1.0\nROBOT = ",
        "cannot be read (it is nested too deeply)",
    ),
    "a part that is changed": ("names.py", "ROBOT = ", "PART = {}\nPART[0] = 1\nROBOT = ", "changes a part"),
    "another meaning of a builtin": ("__init__.py", "joint_names = ", "len = ", "gives len another meaning"),
    "a call in C": (
        "c/link_1.h",
        "        /* Inputs. */\n",
        '        system("touch");\n        /* Inputs. */\n',
        "names system",
    ),
    "a function behind a name in C": (
        "c/link_1.h",
        "        /* Inputs. */\n",
        "        real (*sine)(void) = abort; /* Inputs. */\n",
        "calls real",
    ),
    "a header of C": (
        "c/planar2.c",
        '#include "linkwise/sines.h"',
        "#include <stdlib.h>",
        "has #include <stdlib.h>",
    ),
    "names pasted in C": (
        "c/planar2.c",
        "#define WANT_TORQUE\n",
        "#define WANT_TORQUE\n#define R(x) sys##tem\n",
        "has #define R(x) sys##tem",
    ),
    "code behind a comment's encoding": (
        "forms/link_1.py",
        '"""',
        "# coding: raw_unicode_escape\n# \\u000aimport os\n" + '"""',
        "imports os",
    ),
    "another meaning of all names": (
        "forms/link_1.py",
        "    # inputs\n",
        "    # inputs\n    run = lambda __builtins__: 0\n",
        "gives __builtins__ another meaning",
    ),
    "a declaration in a comment of C": (
        "c/planar2.c",
        "#define WANT_TORQUE\n",
        "#define WANT_TORQUE\n/* int system */ static int a = sizeof(system);\n",
        "names system",
    ),
    "a word of C under another name": (
        "c/planar2.c",
        "#define WANT_TORQUE\n",
        "#define WANT_TORQUE\nstatic int system;\n#define observe system\n",
        "has #define observe system",
    ),
    "a trigraph that ends a string elsewhere": (
        "c/planar2.c",
        "#define WANT_TORQUE\n",
        '#define WANT_TORQUE\nstatic const char a[] = "??/" /* "; // " */;\n',
        "has '??'",
    ),
    "a word of C on two lines": (
        "c/planar2.c",
        "#define WANT_TORQUE\n",
        "#define WANT_TORQUE\nstatic int a = sys\\\ntem(0);\n",
        "has '\\\\\\n'",
    ),
    "a directive in other letters": (
        "c/planar2.c",
        "#define WANT_TORQUE\n",
        "#define WANT_TORQUE\n%:define observe abort\n",
        "has %:",
    ),
    "what runs when a library is loaded": (
        "c/planar2.c",
        "#define WANT_TORQUE\n",
        "#define WANT_TORQUE\nstatic int constructor;\n__attribute__((constructor)) void R(void);\n",
        "names __attribute__",
    ),
    "a function of C that is called as the robot": (
        "c/planar2.c",
        "#define WANT_TORQUE\n",
        "#define WANT_TORQUE\nint planar2_spawn(const char *command);\n",
        "names planar2_spawn",
    ),
    "a comment of C that ends before its line does": (
        "c/planar2.c",
        "#define WANT_TORQUE\n",
        "#define WANT_TORQUE\n// this \r__attribute__((constructor)) void R(void);\n",
        "has '\\r'",
    ),
    "text that is repeated": ("forms/link_1.py", "PATH", "LONG = 'a' * 9999999999\nPATH", "no arithmetic"),
    "a power of numbers": ("forms/link_1.py", "PATH", "LONG = 9**9**9\nPATH", "has a power of numbers"),
    "a number by a name that grows": (
        "forms/link_1.py",
        "PATH",
        "A = 9\nB = A * A\nPATH",
        "computes with numbers alone",
    ),
    "a function of numbers that grow": (
        "forms/link_1.py",
        "PATH",
        "def grow(a):\n    return grow(a * a)\n\n\nGROWN = grow(9)\nPATH",
        "calls its own grow",
    ),
    "a file that is not listed": (
        "c/planar2.c",
        "#define WANT_TORQUE\n",
        '#define WANT_TORQUE\n#include "link_99.h"\n',
        'has #include "link_99.h", which is not listed',
    ),
    "a header of C behind a comment": (
        "c/planar2.c",
        "#define WANT_TORQUE\n",
        "#define WANT_TORQUE\n/* */ # /* */ include <stdlib.h>\n",
        "include <stdlib.h>, which is not listed",
    ),
    "a header of C beside the package": (
        "c/planar2.c",
        "#define WANT_TORQUE\n",
        '#define WANT_TORQUE\n#include "math.h"\n',
        'has #include "math.h", which is not listed',
    ),
    "a changed header": ("c/linkwise/rows.h", "real", "real ", "is not that of linkwise"),
}


@pytest.fixture(scope="module")
def planar2(tmp_path_factory: pytest.TempPathFactory) -> Path:
    package = tmp_path_factory.mktemp("texts") / "planar2"
    write_package(generate(read_system("planar2"), ["numpy", "torch", "autograd", "native", "c"]), package)
    return package


@pytest.fixture
def package(planar2: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(planar2, tmp_path / "planar2"))


def rewritten(package: Path, path: str, change: Callable[[str], str]) -> None:
    """Change a file, and its hash in the manifest with it, as whoever sends a package can."""
    file, manifest = package / path, package / "manifest.json"
    text = change(file.read_text())
    assert text != file.read_text()
    file.write_text(text)
    data = json.loads(manifest.read_text())
    data["files"][path] = hashlib.sha256(text.encode()).hexdigest()
    if "checksums" in data and "files" in data["checksums"]:
        listed = json.dumps(data["files"], sort_keys=True)
        data["checksums"]["files"] = hashlib.sha256(listed.encode()).hexdigest()
    manifest.write_text(json.dumps(data))


@pytest.mark.parametrize("case", FOREIGN)
def test_what_linkwise_does_not_write_is_refused_and_never_run(
    case: str, package: Path, tmp_path: Path
) -> None:
    path, old, new, told = FOREIGN[case]
    mark = tmp_path / "was run"
    rewritten(package, path, lambda text: text.replace(old, new.replace("{mark!r}", repr(str(mark))), 1))
    *before, last = check_package(package, 3)
    assert [result.mark for result in before] == ["ok"]
    assert (last.name, last.mark) == ("texts", "FAIL")
    assert path in last.detail
    assert told in last.detail
    with pytest.raises(LinkwiseError, match=path):
        open_package(package)
    assert not mark.exists()


@pytest.mark.parametrize("path", ["forms/link_1.so", "c/extra.inc", "c/extra.S", "Makefile"])
def test_files_of_kinds_that_linkwise_does_not_write_are_refused(path: str, package: Path) -> None:
    """Python would take the first for a module, before the text beside it; C includes any."""
    (package / path).write_text("")
    rewritten(package, path, lambda text: "int foreign;\n")
    rewritten(package, "c/planar2.c", lambda text: f'{text}#include "{Path(path).name}"\n')
    detail = check_package(package, 3)[-1].detail
    assert f"{path} is no file that linkwise writes" in detail
    assert "which is not listed" in detail


@pytest.mark.parametrize(
    ("path", "line"),
    [
        ("c/planar2.c", "static int a = system;"),
        ("c/planar2.c", '#include "link_99.h"'),
        ("forms/link_1.py", "import os"),
    ],
)
def test_the_line_of_what_linkwise_does_not_write_is_told(path: str, line: str, package: Path) -> None:
    number = (package / path).read_text().count("\n") + 1
    rewritten(package, path, lambda text: f"{text}{line}\n")
    assert f"{path} line {number} " in check_package(package, 3)[-1].detail


def test_a_package_of_another_version_is_opened_with_a_word_of_what_runs_unread(package: Path) -> None:
    rewritten(package, "__init__.py", lambda text: text.replace(f"linkwise {VERSION}", "linkwise 0.0.9", 1))
    manifest = package / "manifest.json"
    data = json.loads(manifest.read_text())
    data["generator"]["linkwise"] = "0.0.9"
    if "checksums" in data:
        text = json.dumps(data["generator"], sort_keys=True)
        data["checksums"]["generator"] = hashlib.sha256(text.encode()).hexdigest()
    manifest.write_text(json.dumps(data))
    with pytest.warns(LinkwiseWarning, match=r"its runtime is that of linkwise 0\.0\.9, .* its code runs"):
        open_package(package)


def test_a_package_of_this_version_is_opened_without_a_word(package: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        open_package(package)


@pytest.mark.parametrize(
    ("spec", "parameters", "kernel"),
    [
        ("turntable.py", "numeric", "auto"),  # with terms linear in the velocities
        ("cart_pendulum.py", "symbolic", "auto"),
        ("skew.toml", "symbolic", "straight"),
        ("skew.toml", "symbolic", "loops"),
        ("fourbar.toml", "numeric", "straight"),
        ("fourbar.toml", "symbolic", "loops"),
        ("knee.osim", "numeric", "loops"),
    ],
)
def test_whatever_linkwise_writes_is_read_as_its_own(spec: str, parameters: str, kernel: str) -> None:
    system = read_system(DATA / spec, Options(parameters))
    written = generate(system, ["numpy", "torch", "autograd", "native", "c"], "robot", kernel=kernel)
    source = Source("robot", VERSION, frozenset(written))
    found = {
        path: foreign_text(path, text.encode(), source) for path, text in written.items() if path != FILE
    }
    assert not [told for told in found.values() if told]
    assert "c/robot.h" in found


def test_every_function_of_closed_forms_may_be_named() -> None:
    assert {name.lower() for name in OF_GRAPHS} <= FUNCTIONS


@pytest.mark.parametrize("text", ["x = (\n", "x = " + "(" * 5000 + ")" * 5000, "\0"])
def test_what_cannot_be_read_is_refused(text: str) -> None:
    found = foreign_text("forms/link_1.py", text.encode(), Source("robot", VERSION, frozenset()))
    assert found is not None
    assert found.startswith("cannot be read (")
