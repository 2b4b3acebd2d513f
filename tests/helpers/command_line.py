"""The command line, called in the process of the tests: a start of Python with its imports takes a second.

How it ends as a process of its own is a matter of test_cli_start.py and test_cli_endings.py.
"""

import io
import subprocess
import sys
import warnings
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any
from unittest.mock import patch

from linkwise import __main__ as start


def run_linkwise(*arguments: Any, folder: Path) -> subprocess.CompletedProcess[str]:
    """`python -m linkwise` with these words in a folder: what it printed, and its exit status."""
    words = [start.__file__, *map(str, arguments)]
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8") for _ in range(2))
    status: Any = None
    with (
        chdir(folder),
        patch.object(sys, "argv", words),
        warnings.catch_warnings(),
        redirect_stdout(out),
        redirect_stderr(err),
    ):
        try:
            start.main()
        except SystemExit as ended:
            status = ended.code
    for stream in (out, err):
        stream.flush()
    printed, said = (stream.buffer.getvalue().decode() for stream in (out, err))
    return subprocess.CompletedProcess(words, status, printed, said)
