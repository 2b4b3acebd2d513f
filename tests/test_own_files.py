"""A link's own files depend on nothing but its path: a longer robot reuses the work already done."""

import pytest
from linkwise import Options, generate, read_system


@pytest.mark.parametrize("parameters", ["numeric", "symbolic"])
def test_links_of_planar3_are_byte_for_byte_those_of_planar4(parameters: str) -> None:
    short, long = (generate(read_system(r, Options(parameters))) for r in ("planar3", "planar4"))  # type: ignore[arg-type]
    own = {path for path in short if "/link_" in path}
    assert {path.split("/")[0] for path in own} == {"autograd", "numpy_forms", "torch_forms", "c"}
    assert len(own) == 4 * 3
    for path in sorted(own):
        assert short[path] == long[path], path
    assert {path for path in long if "/link_" in path} - own == {
        f"{folder}/link_4.{suffix}"
        for folder, suffix in (
            ("autograd", "py"),
            ("numpy_forms", "py"),
            ("torch_forms", "py"),
            ("c", "inc"),
        )
    }
