"""The process that does tasks: one task a line of standard input, beats and outcomes as lines of standard output."""

from __future__ import annotations

import json
import os
import sys
from typing import TextIO

from vidtrack.output.linefile import Every
from vidtrack.run.batch.work import work

_BEAT_S = 0.5
BEAT = "{}\n"


def main() -> None:
    """Do tasks until the input ends."""
    answers = _own_output()
    due = Every(_BEAT_S)

    def beat() -> None:
        if due():
            _say(answers, BEAT)

    for line in sys.stdin:
        _say(answers, json.dumps(work(json.loads(line), beat)) + "\n")


def _say(answers: TextIO, line: str) -> None:
    """Write a line; the process ends at once if nobody reads it."""
    try:
        answers.write(line)
        answers.flush()
    except BrokenPipeError:
        os._exit(1)


def _own_output() -> TextIO:
    """Standard output for answers alone: what libraries print goes to the errors."""
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)
    return answers
