"""The command `slalom`, also `python -m slalom`: the command line, if its extra is installed."""

import sys

from slalom.base.errors import MissingExtra


def main() -> None:
    """Run the command line and exit; without its packages, name the extra with exit code 2."""
    try:
        from slalom.cli import main as run
    except MissingExtra as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(2)
    run()


if __name__ == "__main__":
    main()
