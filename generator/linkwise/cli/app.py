"""Start of the command line: the list of commands, and the report of a mistake."""

import io
import sys
import warnings
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Annotated, Any

import typer
from linkwise_runtime.version import VERSION
from typer.core import TyperGroup

from linkwise.cli import tell
from linkwise.cli.endings import CLOSED_PIPE, FAULT, INTERRUPTED, MISTAKE, TRACEBACK, ended_in_one_line
from linkwise.errors import LinkwiseError, LinkwiseWarning
from linkwise.extras import spare_addresses

COMMANDS = {
    "generate": "Write the packages of robots.",
    "check": "Prove a package right: hashes, and every entry of every formula, back end and C function.",
    "inspect": "Show a robot's joints, links, parameters, and what was merged, locked, ignored or left out.",
    "analyze": "Decompose a recorded movement: every torque term, as a table, figures and a page.",
    "study": "Analyse many recordings: every trial, and what they say together; also on a cluster.",
    "replay": "Run the analysis of a bundle again, and compare its result with the bundle's.",
    "identify": "Identify links from a log of motion and torques: masses, centres, inertias, friction.",
    "example": "Put a whole case into a folder: robot, movement, forces, and what to type next.",
    "cite": "Print the references of what a result used, as BibTeX; without one those of linkwise itself.",
    "graph": "Show what autograd computes for a partial torque, or a part of it; equal operations are one.",
    "motion": "Write two motions modelled on the paper's Fig. 5 and 10, for the arm of Table 2, `planar3`.",
}
REPORTS = {
    "terms": "Count terms and operations of the partial torques, and those that one bucket needs.",
    "reduction": "Draw the share of terms of τ_1 that its q̈_1 part does not need (the paper's Fig. 15).",
}

NUMPY = "numpy"
LOADS = {"analyze": "pyarrow", "study": "pyarrow", "check": "torch", "graph": "torch"}
"""Library that takes most memory in a command, if it is installed; NumPy for other commands."""

STATUSES = (
    f"Exit status: 0 done; 1 a check failed; {MISTAKE} a mistake in the input; {FAULT} a fault of linkwise"
    f" itself, whose traceback {TRACEBACK}=1 shows; {INTERRUPTED} interrupted; {CLOSED_PIPE} output closed."
)


class OnDemand(TyperGroup):
    """A group that imports the file of a command, `NAME` or `GROUP_NAME`, when the command is called.

    Then `--help` need not wait for SymPy and NumPy, and a command not for the libraries of another.
    """

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[Any, Any, list[str]]:
        """Return the command itself in place of the entry that `--help` lists."""
        name, command, rest = super().resolve_command(ctx, args)
        if command is None or isinstance(command, TyperGroup):
            return name, command and readable(command), rest
        loads = LOADS.get(command.name or "", NUMPY)
        spare_addresses(loads if find_spec(loads) else NUMPY)
        group = f"{self.name}_" if self.name else ""
        module = import_module(f"linkwise.cli.{group}{command.name}")
        return name, command_of(module.app), rest


def command_of(app: typer.Typer) -> Any:
    """Return the command of `app`, as `--help` and the documentation show it."""
    return readable(typer.main.get_command(app))


def readable(command: Any) -> Any:
    """Return the command with no types behind its switches, and capitals behind options that may repeat.

    Typer itself shows types of Python there, <bool> and <list[str]>.
    """
    helps = command.get_help_option(typer.Context(command))
    for option in filter(None, (*command.params, helps)):
        if option.metavar is None and getattr(option, "is_flag", False):
            option.metavar = ""
        elif option.metavar is None and getattr(option, "multiple", False):
            option.metavar = option.opts[0].lstrip("-").upper()
    return command


def _group(title: str, commands: dict[str, str], epilog: str | None = None) -> typer.Typer:
    group = typer.Typer(
        cls=OnDemand,
        add_completion=False,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        help=title,
        epilog=epilog,
    )
    for name, line in commands.items():
        group.command(name, help=line)(_entry)
    return group


def _entry() -> None:
    """Stand for a command in the list of commands."""


def _show_version(asked: bool) -> None:
    if asked:
        print(f"linkwise {VERSION}")
        raise typer.Exit


def _show_cmake_dir(asked: bool) -> None:
    if asked:
        print((Path(__file__).parents[1] / "cmake").as_posix())
        raise typer.Exit


app = _group("Which joint's movement loads which joint, through which link.", COMMANDS, STATUSES)
app.add_typer(_group("Term counts and the cost-reduction curve.", REPORTS), name="report")


@app.callback()
def _options(
    version: Annotated[
        bool, typer.Option("--version", is_eager=True, callback=_show_version, help="Print the version")
    ] = False,
    cmake_dir: Annotated[
        bool,
        typer.Option(
            "--cmake-dir",
            is_eager=True,
            callback=_show_cmake_dir,
            help="Print the folder of linkwise's CMake module, for -Dlinkwise_DIR=",
        ),
    ] = False,
) -> None:
    """Stand for the options of the whole program."""


def main() -> None:
    """Run the command line; an early end gives one line on stderr, and an exit status (see `endings`)."""
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")  # whatever letters the terminal lacks
    if not sys.warnoptions:
        warnings.simplefilter("ignore")  # of libraries, to programmers
        warnings.simplefilter("default", LinkwiseWarning)
    warnings.showwarning = lambda message, *_, **__: tell(f"warning: {message}", err=True)
    status = 0
    with ended_in_one_line():
        command = command_of(app)
        try:
            # Not by calling it, which ends the program at a closed pipe, and at Ctrl-C, in ways of its own.
            called = "python -m linkwise" if sys.argv[0].endswith("__main__.py") else "linkwise"
            with command.make_context(called, sys.argv[1:]) as context:
                command.invoke(context)
        except typer.Exit as ended:
            status = ended.exit_code
        except Exception as error:
            # Typer's own complaints about options; anything else is not its matter.
            if not hasattr(error, "format_message"):
                raise
            if not (message := error.format_message()):
                sys.exit(MISTAKE)  # the help was shown, for want of a command
            # "Value error, " is pydantic's, which typer asks about values.
            asked = getattr(getattr(error, "ctx", None), "command_path", "linkwise")
            message = message.replace("Value error, ", "").rstrip(".")
            raise LinkwiseError(f"{message}. See {asked} --help") from error
    sys.exit(status)
