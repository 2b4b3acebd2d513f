"""Writing a package: all of it or nothing."""

import shutil
import tempfile
from collections.abc import Mapping
from pathlib import Path

from linkwise.errors import LinkwiseError


def write_package(files: Mapping[str, str], directory: Path) -> None:
    """Write files below `directory`, replacing an earlier package there; a failure leaves the old one.

    Raises LinkwiseError when the place is not writable or holds something that is no generated package.
    """
    package = (directory / "manifest.json").is_file()
    if directory.exists() and not package and (not directory.is_dir() or any(directory.iterdir())):
        raise LinkwiseError(f"{directory} exists and is no generated package; choose another --out or --name")
    try:
        directory.parent.mkdir(parents=True, exist_ok=True)
        staging = Path(tempfile.mkdtemp(prefix=f".{directory.name}-", dir=directory.parent))
    except OSError as error:
        raise LinkwiseError(
            f"cannot write to {directory.parent}: {error.strerror}; choose another --out"
        ) from None
    try:
        for path, text in files.items():
            target = staging / path
            target.parent.mkdir(parents=True, exist_ok=True)
            target.write_text(text, encoding="utf-8")
        staging.chmod(0o755)
        if directory.exists():
            shutil.rmtree(directory)
        staging.rename(directory)
    except OSError as error:
        raise LinkwiseError(f"cannot write {directory}: {error.strerror}; choose another --out") from None
    finally:
        shutil.rmtree(staging, ignore_errors=True)
