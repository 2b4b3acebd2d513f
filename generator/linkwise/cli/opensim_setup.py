"""A setup file of OpenSim's in place of a log, a robot and the options that it has."""

from typing import Any

from linkwise.analysis.choices import AnalysisChoices
from linkwise.cli import tell
from linkwise.errors import LinkwiseError
from linkwise.option import written


def with_setup(given: dict[str, Any]) -> dict[str, Any]:
    """Return what was given to `analyze`, with what a setup file has for it.

    Raises LinkwiseError for what is given twice, and for a log or robot that is not given at all.
    """
    if given["opensim_setup"] is None:
        for name, shown in (("log", "argument 'LOG'"), ("robot", "option '--robot'")):
            if given[name] is None:
                raise LinkwiseError(f"Missing {shown}. See linkwise analyze --help")
        return given
    from linkwise.analysis.opensim.setup import read_setup  # the readers need SymPy

    setup = read_setup(given["opensim_setup"])
    flags = {one.key: one.flag for one in written(AnalysisChoices)}
    usual = {one.key: one.default for one in written(AnalysisChoices)}
    found = {"log": setup.log, "robot": setup.robot, **setup.options}
    for key, value in found.items():
        if given[key] not in (None, [], usual.get(key), value):
            flag = flags.get(key, {"log": "LOG"}.get(key, f"--{key}"))
            raise LinkwiseError(
                f"{flag}: {given['opensim_setup']} says that; leave it out, or change it there"
            )
    for line in setup.told:
        tell(f"warning: {given['opensim_setup']}: {line}", err=True)
    return {**given, **found}
