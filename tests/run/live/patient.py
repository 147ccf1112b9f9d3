"""`vidtrack live` as a user runs it, with all the time that a slow machine needs to end a run well."""

from functools import partial
from threading import Timer

import command_line
from cameras import HANG_S

_CODE = """
import vidtrack.cli.signals as signals, vidtrack.video.live.source as source
import vidtrack.run.live.supervisors as supervisors, vidtrack.run.live.run as run
import vidtrack.run.live.supervisor as supervisor
signals._PATIENCE_S = supervisor.END_S = supervisors._END_S = run._END_S = 60.0
source._END_S = 10.0
from vidtrack.__main__ import main
main()
"""


start = partial(command_line.start, program=("-c", _CODE))


def line_with(words, process):
    """The next line with these words that it tells; a process that tells none is killed."""
    hang = Timer(HANG_S, process.kill)
    hang.start()
    try:
        return next(line for line in process.stderr if words in line)
    finally:
        hang.cancel()
