"""docs/licences.md has every package that linkwise brings, with the licence that its metadata say."""

import re

import pytest
from tools.licences import BINDING, DEVELOPERS, MARK, PAGE, USERS, licence, packages_of

TEXT = PAGE.read_text(encoding="utf-8")
LISTED = dict(re.findall(r"^\| ([\w-]+) \| (.+?) \| [\w-]+ \|$", TEXT.partition(MARK)[2], re.MULTILINE))


@pytest.mark.parametrize("extra", [*USERS, *BINDING, *DEVELOPERS])
def test_every_package_is_listed_as_its_metadata_say(extra: str) -> None:
    brought = packages_of([extra])
    assert brought
    assert {name: licence(package) for name, package in brought.items()} == {
        name: LISTED.get(name) for name in brought
    }


def test_users_are_brought_no_licence_that_binds_their_own_programs() -> None:
    assert not [name for name in packages_of(USERS) if re.search(r"\bA?GPL", LISTED[name])]
    assert not {"spm1d"} & set(packages_of(["all"])), "whose metadata do not say that it is under the GPL"


def test_every_package_is_pinned_so_that_the_page_is_right_tomorrow_too() -> None:
    lines = (PAGE.parents[1] / "constraints.txt").read_text(encoding="utf-8").splitlines()
    pinned = {re.sub(r"[-_.]+", "-", line.partition("==")[0]).lower() for line in lines}
    assert not set(packages_of([*USERS, *BINDING, *DEVELOPERS])) - pinned
