"""A link's own files depend on nothing but its path: a longer robot reuses the work already done."""

import re

import pytest
from linkwise import Options, generate, read_system

OWN = re.compile(r"_\d+\.(py|h)$")


@pytest.mark.parametrize("parameters", ["numeric", "symbolic"])
def test_links_of_planar3_are_byte_for_byte_those_of_planar4(parameters: str) -> None:
    short, long = (generate(read_system(r, Options(parameters))) for r in ("planar3", "planar4"))  # type: ignore[arg-type]
    own = {path for path in short if OWN.search(path)}
    assert {path.split("/")[0] for path in own} == {"energies", "forms", "c"}
    for path in sorted(own):
        assert short[path] == long[path], path
    added = {path for path in long if OWN.search(path)} - own
    assert added == {path.replace("_3.", "_4.") for path in own if "_3." in path}
