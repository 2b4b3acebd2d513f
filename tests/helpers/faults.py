"""A writer that is killed, interrupted or given errors at each of its system calls, by strace.

Started once, the program here has imported all that a job needs; then strace is tied to it, and it forks for
each fault. strace counts the calls of each kind in each process and strikes at a fixed number; the child has
made so many idle calls of the fault's kind that this is the one meant.
"""

import ctypes
import fcntl
import json
import os
import re
import shutil
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass
from pathlib import Path

from linkwise.errors import LinkwiseError
from linkwise.output import whole_directory

sys.path.insert(0, str(Path(__file__).parents[1]))

from helpers.needed import missing

WHEN = {"write": 200, "generate": 1000, "analyze": 400}
"""More calls of each kind than a job makes, or who forks, for which Python 3.12 opens a file each time."""
NO_EXCHANGE = "--inject=renameat2:error=ENOSYS"
"""A file system that cannot exchange two folders in one step."""
NAMES = ("a", "b", "c", "sub/d", "sub/e", "sub/f")
"""Files that the job `write` writes."""
WORKPLACE = ".linkwise-"
NONE = "/nowhere"
IDLE: dict[str, Callable[[], object]] = {
    "mkdir": lambda: os.mkdir("/"),
    "mkdirat": lambda: os.mkdir("/"),
    "openat": lambda: os.open(NONE, os.O_RDONLY),
    "write": lambda: os.write(-1, b""),
    "rename": lambda: os.rename(NONE, NONE),
    "renameat": lambda: os.rename(NONE, NONE),
    "renameat2": lambda: ctypes.CDLL(None).renameat2(-1, b"", -1, b"", 2),
    "unlink": lambda: os.unlink(NONE),
    "unlinkat": lambda: os.unlink("nowhere", dir_fd=9999),
    "rmdir": lambda: os.rmdir(NONE),
    "fsync": lambda: os.fsync(9999),
    "flock": lambda: fcntl.flock(9999, fcntl.LOCK_UN),
}
CALLS = tuple(IDLE)
"""Calls that change files, or open or lock them; of two names for one, a processor may have one only."""


@dataclass(frozen=True)
class Fault:
    """Fault that strikes when the job makes `call` for the `number`th time."""

    call: str
    number: int


@dataclass(frozen=True)
class End:
    """End of a job: -9 if killed, else its exit status, and what it said."""

    status: int
    said: str


def untraceable() -> str:
    """Return why there is no fault injection here; empty where there is."""
    if absent := missing("strace"):
        return absent
    probe = ["strace", "-qq", "-e", "inject=fsync:error=EIO", "true"]
    tried = subprocess.run(probe, capture_output=True, check=False)
    return "" if tried.returncode == 0 else "needs ptrace, which is not allowed here"


def faults(job: str, where: Path, prepare: Callable[[Path], None], options: Sequence[str]) -> list[Fault]:
    """A fault for each of the `CALLS` that a job makes once it writes; `prepare` fills its folder."""
    prepare(where / "0")
    log = where / "calls"
    run(job, where, [Fault("", 0)], (*options, f"--output={log}"))
    lines = [line.split(maxsplit=1) for line in log.read_text().splitlines()]
    writer = next(thread for thread, text in lines if WORKPLACE in text)
    count: Counter[str] = Counter()
    found: list[Fault] = []
    last = 0
    for thread, text in lines:
        made = re.match(r"(\w+)\(", text)
        if made is None or thread != writer or (made[1] == "renameat2" and NO_EXCHANGE in options):
            continue
        count[made[1]] += 1
        if found or WORKPLACE in text:
            found.append(Fault(made[1], count[made[1]]))
        if WORKPLACE in text:
            last = len(found)  # what it says at its end touches no file
    assert max(count.values()) < WHEN[job]
    return found[:last]


def suffer(
    job: str,
    where: Path,
    prepare: Callable[[Path], None],
    plan: Sequence[Fault],
    what: str,
    options: Sequence[str],
) -> list[End]:
    """Do a job once for each fault, the first in `where`/0; what: "signal=SIGKILL", say, or "error=EIO"."""
    for number in range(len(plan)):
        prepare(where / str(number))
    calls = [call for call in CALLS if not (call == "renameat2" and options)]
    inject = f"--inject={','.join('?' + call for call in calls)}:{what}:when={WHEN[job]}"
    return run(job, where, plan, (*options, inject, f"--output={os.devnull}"))


def run(job: str, where: Path, plan: Sequence[Fault], options: Sequence[str]) -> list[End]:
    shutil.rmtree(where / "warm", ignore_errors=True)
    program = subprocess.Popen(
        [sys.executable, __file__, job], cwd=where, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert program.stdin is not None
    assert program.stdout is not None
    program.stdout.readline()
    trace = "--trace=" + ",".join(f"?{call}" for call in CALLS)
    tied = ["strace", "-f", f"--attach={program.pid}", trace, *options]
    with subprocess.Popen(tied, stderr=subprocess.PIPE, text=True) as strace:
        assert strace.stderr is not None
        attached = strace.stderr.readline()
        assert "attached" in attached, attached
        program.stdin.write(json.dumps([(fault.call, fault.number) for fault in plan]))
        program.stdin.close()
        strace.stderr.read()
        answer = program.stdout.read()
    program.stdout.close()
    assert program.wait() == 0
    ends = zip(json.loads(answer), map(str, range(len(plan))), strict=True)
    return [End(status, (where / f"{number}.said").read_text()) for status, number in ends]


def write_target() -> object:
    with whole_directory(Path("target"), lambda target: None) as draft:
        (draft / "sub").mkdir()
        for name in NAMES:
            (draft / name).write_text("new")
    return 0


def command(line: str) -> Callable[[], object]:
    from linkwise.cli.app import app

    return lambda: app(line.split(), standalone_mode=False)


JOBS: dict[str, Callable[[], object]] = {
    "write": write_target,
    "generate": command("generate planar2 --backend numpy --name target --out ."),
    "analyze": command(
        "analyze ../motion/recorded.csv --robot ../robot/planar3 --format csv --no-page --out target"
    ),
}


def child(number: int, call: str, times: int, job: Callable[[], object]) -> int:
    said = os.open(f"{number}.said", os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(said, 1)
    os.dup2(said, 2)
    os.chdir(str(number))
    idle = IDLE.get(call, lambda: None)
    for _ in range(times):
        with suppress(OSError):
            idle()
    try:
        job()
    except LinkwiseError as error:
        os.write(2, str(error).encode())
        return 2
    except KeyboardInterrupt:
        return 130
    except SystemExit as ended:
        return int(ended.code or 0)
    return 0


def main(name: str) -> None:
    job, when = JOBS[name], WHEN[name]
    os.mkdir("warm")
    os.chdir("warm")
    with open(os.devnull, "w") as nothing, redirect_stdout(nothing), redirect_stderr(nothing):
        job()  # so that a child imports nothing
    os.chdir("..")
    libc = ctypes.CDLL(None)
    libc.prctl(0x59616D61, ctypes.c_ulong(-1))  # any process of this user may trace this one
    print("ready", flush=True)
    statuses = []
    for number, (call, at) in enumerate(json.load(sys.stdin)):
        process = os.fork()
        if process == 0:
            os._exit(child(number, call, when - at if call else 0, job))
        statuses.append(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]))
    print(json.dumps(statuses))


if __name__ == "__main__":
    main(sys.argv[1])
