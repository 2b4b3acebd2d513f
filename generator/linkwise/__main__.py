"""`python -m linkwise`, and the script `linkwise`."""

import sys


def main() -> None:
    """Run the command line; an interrupt while it is being imported ends it as a later one does."""
    try:
        from linkwise.cli.app import main as run
    except KeyboardInterrupt:
        print("linkwise: interrupted", file=sys.stderr)
        sys.exit(130)
    run()


if __name__ == "__main__":
    main()
