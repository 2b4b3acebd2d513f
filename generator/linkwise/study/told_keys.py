"""Messages about a study's trials name keys of its file, where those of a command name flags."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

from linkwise.analysis.choices import AnalysisChoices
from linkwise.errors import LinkwiseError
from linkwise.option import written
from linkwise.robot import Options

FLAG = re.compile(r"--[a-z][a-z0-9-]*(?: cycle=)?")
KEYS = {one.flag: f"[robot] {one.key}" for one in written(Options)}
KEYS |= {one.flag: f"[analysis] {one.key}" for one in written(AnalysisChoices) if one.option.is_key}
KEYS |= {"--phase cycle=": "[cycles] "}
"""Keys by flag, each behind the table that it stands in; a trial may have those of [analysis] itself."""


@contextmanager
def by_keys() -> Iterator[None]:
    """Name the keys of a study in every LinkwiseError raised inside, in place of flags that have one."""
    try:
        yield
    except LinkwiseError as error:
        raise LinkwiseError(FLAG.sub(_key, str(error))) from error


def _key(flag: re.Match[str]) -> str:
    own, _, rest = flag[0].partition(" ")
    return KEYS.get(flag[0]) or f"{KEYS.get(own, own)}{rest and ' ' + rest}"
