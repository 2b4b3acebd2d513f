"""A quick start: what `import linkwise` and `linkwise --help` load, and that every public name is there."""

import inspect
import os
import pydoc
import re
import subprocess
import sys
import tomllib
from importlib import import_module
from pathlib import Path

import linkwise
import pytest
import typer
from helpers.search_path import before
from linkwise.cli.app import COMMANDS, REPORTS, readable
from linkwise.option import chosen, written
from linkwise.robot import DESCRIPTIONS, Options
from typer.core import TyperGroup

HEAVY = {"sympy", "numpy", "scipy", "torch", "matplotlib", "pyarrow", "plotly", "mujoco", "jinja2"}


def loaded(code: str, *arguments: str) -> set[str]:
    """Return the heavy libraries that a program has loaded by its end."""
    report = f"import atexit, sys; atexit.register(lambda: print('loaded', *{HEAVY} & set(sys.modules)))\n"
    done = subprocess.run(
        [sys.executable, "-c", report + code, *arguments], capture_output=True, text=True, check=True
    )
    return set(done.stdout.splitlines()[-1].split()[1:])


def test_what_stdout_cannot_encode_is_escaped() -> None:
    command = [sys.executable, "-m", "linkwise", "report", "terms", "planar1"]
    environment = os.environ | {"PYTHONIOENCODING": "latin-1"}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert "| \\u03c4_1,1 | link1 |" in done.stdout


SCRIPT = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text())["project"]["scripts"]
STARTS = {
    "module": ("-m", "linkwise"),
    "script": ("-c", "from {} import {} as main; main()".format(*SCRIPT["linkwise"].split(":"))),
}


@pytest.mark.parametrize("start", STARTS)
def test_an_interrupt_while_libraries_are_imported_is_one_line(start: str, tmp_path: Path) -> None:
    (tmp_path / "typer.py").write_text("raise KeyboardInterrupt")
    command, environment = [sys.executable, *STARTS[start]], os.environ | {"PYTHONPATH": before(tmp_path)}
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (130, "linkwise: interrupted\n")


def test_import_loads_no_heavy_library() -> None:
    assert loaded("import linkwise; linkwise.LinkwiseError, dir(linkwise), linkwise.__version__") == set()
    assert "sympy" in loaded("import linkwise; linkwise.System")


def test_a_room_is_loaded_when_one_of_its_names_is_used() -> None:
    assert "sympy" not in loaded("from linkwise import analyze, check_package, write_package")


@pytest.mark.parametrize("arguments", [("--help",), ("report", "--help"), ("frobnicate",), ()])
def test_help_loads_no_heavy_library(arguments: tuple[str, ...]) -> None:
    code = "from linkwise.cli.app import main\ntry:\n    main()\nexcept SystemExit:\n    pass"
    assert loaded(code, *arguments) == set()


def test_every_public_name_is_there() -> None:
    names = set(linkwise.__all__)
    assert names <= set(dir(linkwise))
    assert all(getattr(linkwise, name) is not None for name in names)
    scope: dict[str, object] = {}
    exec("from linkwise import *", scope)
    assert names <= set(scope)
    assert "read_system" in pydoc.render_doc(linkwise)
    with pytest.raises(AttributeError, match="module 'linkwise' has no attribute 'frobnicate'"):
        linkwise.frobnicate  # noqa: B018


def command(name: str) -> typer.core.TyperCommand:
    found = typer.main.get_command(import_module(f"linkwise.cli.{name}").app)
    assert not isinstance(found, TyperGroup)
    return found


FILES = {**COMMANDS, **{f"report_{name}": line for name, line in REPORTS.items()}}


@pytest.mark.parametrize("file", FILES)
def test_help_shows_no_type_of_python_behind_switches_and_repeated_options(file: str) -> None:
    shown = readable(command(file))
    options = [*shown.params, shown.get_help_option(typer.Context(shown))]
    switches = [option for option in options if getattr(option, "is_flag", False)]
    assert {"help"} <= {option.name for option in switches}
    assert {option.metavar for option in switches} == {""}
    repeated = [option.metavar for option in options if getattr(option, "multiple", False)]
    assert all(re.match("[A-Z]", metavar) for metavar in repeated)


@pytest.mark.parametrize("file", FILES)
def test_list_of_commands_says_what_the_command_says_of_itself(file: str) -> None:
    said = command(file)
    assert said.help == FILES[file]
    assert said.name == file.removeprefix("report_")


@pytest.mark.parametrize("file", ["generate", "inspect", "report_terms", "report_reduction"])
def test_every_command_that_reads_a_robot_takes_every_flag(file: str) -> None:
    options = {parameter.name: parameter for parameter in command(file).params}
    assert set(inspect.signature(Options).parameters) <= set(options)
    described = options["robot"].help
    assert described.endswith(DESCRIPTIONS)


def test_flags_are_the_options_by_name_and_default() -> None:
    flags = {one.key: one.default for one in written(Options)}
    assert list(flags) == list(inspect.signature(Options).parameters)
    assert chosen(Options, flags) == chosen(Options, {}) == Options()


def test_help_of_generate_names_the_back_ends_of_the_registry() -> None:
    from linkwise.emit.backend import BACKENDS

    backend = next(parameter for parameter in command("generate").params if parameter.name == "backend")
    assert re.findall(r"\w+", backend.help)[: len(BACKENDS)] == list(BACKENDS)
