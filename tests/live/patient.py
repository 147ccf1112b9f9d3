"""`vidtrack live` as a user runs it, with all the time that a slow machine needs to end a run well."""

import subprocess
import sys

from command_line import ENVIRONMENT

_CODE = """
import vidtrack.cli.signals, vidtrack.live.run
vidtrack.cli.signals._PATIENCE_S = vidtrack.live.run._END_S = 60.0
from vidtrack.__main__ import main
main()
"""


def start(*arguments, cwd, stderr=subprocess.PIPE):
    """A running `vidtrack` with its output in pipes."""
    command = [sys.executable, "-c", _CODE, *map(str, arguments)]
    return subprocess.Popen(command, cwd=cwd, stdout=subprocess.PIPE, stderr=stderr, text=True, env=ENVIRONMENT)
