"""A directory of results that appears whole or not at all."""

import shutil
import signal
import sys
import tempfile
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from linkwise.errors import LinkwiseError


@contextmanager
def whole_directory(target: Path, mark: str) -> Iterator[Path]:
    """Yield a directory to write into; it becomes `target` at the end, and goes after an error.

    An existing `target` is replaced only if empty or, by its file `mark`, a former result.
    """
    if target.exists() and not (target.is_dir() and (_empty(target) or (target / mark).is_file())):
        raise LinkwiseError(
            f"{target}: exists and is no former result (it has no {mark}); give another --out"
        )
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        draft = Path(tempfile.mkdtemp(prefix=f".{target.name}.", dir=target.parent))
    except OSError as error:
        raise LinkwiseError(f"{target}: cannot be written: {error.strerror}") from error
    try:
        yield draft
        draft.chmod(0o755)
        _swap(draft, target)
    except OSError as error:  # a full disk, above all
        raise LinkwiseError(f"{target}: nothing was written: {error}") from error
    finally:
        shutil.rmtree(draft, ignore_errors=True)


@contextmanager
def ended_by_signal() -> Iterator[None]:
    """Let SIGTERM end the work as an error does: what is half written goes."""
    if threading.current_thread() is not threading.main_thread():
        yield  # only the main thread may set handlers
        return
    former = signal.signal(signal.SIGTERM, lambda number, _: sys.exit(128 + number))
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, former)


def _swap(draft: Path, target: Path) -> None:
    """Rename `draft` to `target`; a former `target` comes back if that fails."""
    if not target.exists():
        draft.rename(target)
        return
    former = draft.with_name(draft.name + ".former")
    target.rename(former)
    try:
        draft.rename(target)
    except OSError:
        former.rename(target)
        raise
    shutil.rmtree(former)


def _empty(directory: Path) -> bool:
    return next(directory.iterdir(), None) is None
