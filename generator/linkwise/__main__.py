"""`python -m linkwise`, and the script `linkwise`."""

import os
import sys


def main() -> None:
    """Run the command line; an interrupt while it is being imported ends it as a later one does."""
    _open_closed()
    try:
        from linkwise.cli.app import main as run
    except KeyboardInterrupt:
        print("linkwise: interrupted", file=sys.stderr)
        sys.exit(130)
    run()


def _open_closed() -> None:
    """Have streams that the caller closed lead nowhere: a file opened later would get their numbers.

    Python has None for them, and prints what is meant for stderr to stdout.
    """
    closed = [(k, name) for k, name in enumerate(("stdin", "stdout", "stderr")) if getattr(sys, name) is None]
    for number, _ in closed:
        try:
            os.fstat(number)
        except OSError:
            # A file gets the lowest free number, this one; compilers and workers print there, too.
            os.set_inheritable(os.open(os.devnull, os.O_RDWR), True)
    for number, name in closed:
        setattr(sys, name, open(os.devnull, "w" if number else "r", encoding="utf-8"))  # noqa: SIM115


if __name__ == "__main__":
    main()
