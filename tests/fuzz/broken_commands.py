"""Generated robots with a broken manifest, and odd command lines."""

import json
from functools import cache
from random import Random

from linkwise import generate, read_system

from fuzz.case import NUMPY, Case
from fuzz.mutations import TEXTS, encoded, mutated_data, mutated_text
from fuzz.valid_robots import random_robot, toml_data, toml_text, urdf_text

LOG = "\n".join(
    ["time,joint1,joint2,joint3", *(f"{k / 100},{k / 50},0.1,{-k / 70}" for k in range(12))]
).encode()


def manifest(rng: Random) -> Case:
    """A generated robot whose manifest was changed."""
    text, chance = _manifest_text(), rng.random()
    if chance < 0.75:
        text = json.dumps(mutated_data(rng, json.loads(text)), ensure_ascii=rng.random() < 0.5)
    elif chance < 0.8:
        text = text.replace("2", "[" * rng.choice((500, 100_000)), 1)
    if chance > 0.7:
        text = mutated_text(rng, text)
    files = {"package/manifest.json": encoded(rng, text), "log.csv": LOG}
    package = "{in}/package"
    commands: tuple[tuple[str, ...], ...] = (
        ("check", package, "--samples", "2"),
        ("check", package, "--samples", "2", "--json"),
        ("analyze", "{in}/log.csv", "--robot", package, "--out", "{out}", "--no-page", "--format", "csv"),
        ("generate", "planar3", "--out", "{in}", "--name", "package", *NUMPY),
    )
    return Case(rng.choice(commands), files, copied=True)


READS_ROBOT = """
--lock joint1=0|joint1=0.5|joint1=nan|joint2=1e400|=1|joint1
--root base|joint1 link|link1
--tip base|joint1 link|link2
--base floating|fixed
--parameters symbolic|numeric
--allow-unphysical
--free-mimic
"""
READS_LOG = """
--units rad|deg
--time time
--map joint1=joint2|a=b|joint1=joint1
--resample 50|1e-9|1e9|0
--derivative savitzky-golay|five-point
--window 5|4
--degree 2|99
--cutoff 4|1e9|1e-9
--filter-order 2|13
--padding odd|none
--edges trim
--convention gradient
--format csv
--figure paper|paper:joint2|paper:x
--load link3=1,2,3|link2=1,2,3,4,5,6@0,0,1
--backend numpy|native
--json
"""
ROBOTS = "planar2|{in}/robot.urdf|{in}/robot.toml|torso|{in}|planar3|{in}/log.csv"
COMMANDS = {
    f"inspect\n{ROBOTS}": f"{READS_ROBOT}--json\n--joint-friction",
    f"generate\n{ROBOTS}\n{{to}}\n--backend numpy|numpy|c": f"{READS_ROBOT}--name x|planar2",
    "check\n{robot}|{in}\n--samples 2|1": "--json",
    "analyze\n{in}/log.csv\n--robot {robot}\n{to}": READS_LOG,
    f"report\nterms\n{ROBOTS}\n--budget 1000|1": f"{READS_ROBOT}--joint joint1|1\n--link link1|1\n--json",
    "report\nreduction\n--dof 1..2|1..1": "--budget 10\n--json",
    "motion\n{to}": "--json",
    "{odd}\n{odd}": READS_ROBOT,
}
"""Words of each command, one a line, and the flags that may follow; `a|b` is one of them or odd."""

TO = ("{out}", "{out}", "{in}", "{in}/log.csv", "{out}/" + "a" * 300, "{out}/ä\n")
ODD = [text.replace("\x00", "") for text in TEXTS] + ["0", "1..3", "3..1", "1..", "a..b", "1" * 30]


def options(rng: Random) -> Case:
    """Right files, odd command lines."""
    start, flags = rng.choice(list(COMMANDS.items()))
    further = (flags + "\n{odd}").split("\n")
    lines = start.split("\n") + rng.sample(further, rng.randint(0, min(3, len(further))))
    arguments = [word for line in lines for word in _words(rng, line)]
    small = random_robot(rng, 2, 4)
    files = {"robot.toml": toml_text(toml_data(small)).encode(), "robot.urdf": urdf_text(small).encode()}
    return Case(tuple(arguments), files | {"log.csv": LOG})


def _words(rng: Random, line: str) -> list[str]:
    """The words of a line: the target, a flag with or without a value, or a value alone."""
    if line == "{to}":
        return ["--out", rng.choice(TO)]
    flag, _, values = line.partition(" ") if line.startswith("--") else ("", "", line)
    if flag and not values:
        return [flag]
    alone = "|" not in values and not flag and values != "{odd}"  # the name of a command
    odd = values == "{odd}" or (not alone and rng.random() < 0.3)
    value = rng.choice(ODD) if odd else rng.choice(values.split("|"))
    return [flag, value] if flag else [value]


@cache
def _manifest_text() -> str:
    return generate(read_system("planar3"), ["numpy"])["manifest.json"]
