"""`python -m linkwise`."""

from linkwise.cli.app import main

if __name__ == "__main__":
    main()
