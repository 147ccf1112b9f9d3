"""A Python process beside this one, with the same vidtrack."""

from __future__ import annotations

import json
import subprocess
import sys
from atexit import register
from contextlib import suppress
from os import cpu_count

from vidtrack.compiled import PACKAGE


def python(statement: str) -> list[str]:
    """Command of a process that runs a statement with the vidtrack of this process.

    Python looks first in the folder that it runs in, where another vidtrack may lie, as in a clone beside an installed
    copy: it would compile kernels of its own, or do another version's work.
    """
    return [
        sys.executable,
        "-c",
        f"import sys; sys.path[:] = [{str(PACKAGE.parent)!r}, *filter(None, sys.path)]; {statement}",
    ]


def help_beside(statement: str, told: object = None) -> None:
    """Start a process on the second core, if there is one, that runs a statement and is ended when this one exits.

    It finds `told` as JSON in its standard input: others may read the words of a command, and settings may hold
    passwords. It only does early what this process would do; what fails there fails here, and is reported here.
    """
    if (cpu_count() or 1) < 2:
        return
    helper = subprocess.Popen(
        python(statement), stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, text=True
    )
    register(helper.kill)
    assert helper.stdin is not None
    with suppress(BrokenPipeError), helper.stdin:
        json.dump(told, helper.stdin)
