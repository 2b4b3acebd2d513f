"""The command line's start: which commands there are, and how a mistake is told."""

import sys
from importlib import import_module
from typing import Any, NoReturn

import typer
from typer.core import TyperGroup

from linkwise.errors import LinkwiseError

COMMANDS = {
    "generate": "Write the package of a robot.",
    "check": "Prove a package right: hashes, and every entry of every formula, back end and C function.",
    "inspect": "Show a robot's joints, links and parameters, and what was merged, locked or ignored.",
    "analyze": "Who loads whom: every torque term of a recorded movement, as a table, figures and a page.",
    "motion": "Write two motions modelled on the paper's Fig. 5 and 10, for the arm of Table 2, `planar3`.",
}
REPORTS = {
    "terms": "Count terms and operations of the partial torques, and those that one bucket needs.",
    "reduction": "Draw the share of terms of τ_1 that its q̈_1 part does not need (the paper's Fig. 15).",
}


class OnDemand(TyperGroup):
    """A group that imports the file of a command, `NAME` or `GROUP_NAME`, when the command is called.

    So `--help` need not wait for SymPy and NumPy, and a command not for the libraries of another.
    """

    def resolve_command(self, ctx: Any, args: list[str]) -> tuple[Any, Any, list[str]]:
        """Put the command itself in place of the entry that `--help` lists."""
        name, command, rest = super().resolve_command(ctx, args)
        if command is None or isinstance(command, TyperGroup):
            return name, command, rest
        group = f"{self.name}_" if self.name else ""
        module = import_module(f"linkwise.cli.{group}{command.name}")
        return name, typer.main.get_command(module.app), rest


def _group(title: str, commands: dict[str, str]) -> typer.Typer:
    group = typer.Typer(
        cls=OnDemand,
        add_completion=False,
        no_args_is_help=True,
        pretty_exceptions_enable=False,
        help=title,
    )
    for name, line in commands.items():
        group.command(name, help=line)(_entry)
    return group


def _entry() -> None:
    """Stand in the list of commands."""


app = _group("Which joint's movement loads which joint, through which link.", COMMANDS)
app.add_typer(_group("Term counts and the cost-reduction curve.", REPORTS), name="report")


def main() -> None:
    """Run the command line; a user's mistake is one line on stderr and exit status 2."""
    try:
        status = typer.main.get_command(app)(standalone_mode=False)
    except LinkwiseError as error:
        _fail(str(error))
    except typer.Abort:
        sys.exit(130)
    except Exception as error:
        # Typer's own complaints about options; anything else is not the user's mistake.
        if not hasattr(error, "format_message"):
            raise
        if message := error.format_message():  # empty where the help was shown for want of a command
            # "Value error, " is pydantic's, which typer asks about values.
            asked = getattr(getattr(error, "ctx", None), "command_path", "linkwise")
            _fail(f"{message.replace('Value error, ', '').rstrip('.')}. See {asked} --help")
        sys.exit(2)
    sys.exit(status if isinstance(status, int) else 0)


def _fail(message: str) -> NoReturn:
    print(f"linkwise: error: {' '.join(message.split())}", file=sys.stderr)
    sys.exit(2)
