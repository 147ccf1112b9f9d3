"""`vidtrack` and `python -m vidtrack`."""

from typing import NoReturn

from vidtrack import cli
from vidtrack.run.live.leave import leave


def main() -> NoReturn:
    """Run a command, and end the process with its exit code."""
    try:
        cli.main()
    except SystemExit as end:
        leave(end.code if isinstance(end.code, int) else 0)
    leave(0)


if __name__ == "__main__":
    main()
