"""`vidtrack` and `python -m vidtrack`."""

from typing import NoReturn

from vidtrack import cli
from vidtrack.run.live.leave import run_and_leave


def main() -> NoReturn:
    """Run a command, and end the process with its exit code."""
    run_and_leave(cli.main)


if __name__ == "__main__":
    main()
