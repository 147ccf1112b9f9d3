"""A Python process beside this one, with the same vidtrack."""

from __future__ import annotations

import sys

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
