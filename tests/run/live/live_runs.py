"""Live runs for the tests: they go on until something has happened, however long that takes."""

from threading import Timer
from typing import NamedTuple

from cameras import HANG_S

from vidtrack.config.load import load
from vidtrack.tracks import Status

NEVER_ROLLS = "live.roll_s=1e10"  # parts, and the first one lasts: its clock began in 1970


class Seen(NamedTuple):
    """What is remembered of a step: number, time, and the ids of its tracks that are not tentative."""

    index: int
    time_s: float
    tracks: frozenset[int]


def settings(*assignments):
    """Settings with which a camera on a slow machine is not taken for lost."""
    return load(assignments=["live.timeout_s=60", "live.backoff_s=0.05", *assignments])


def play(run, story):
    """Iterate over a run while a story unfolds.

    `story(seen)` yields conditions on what was seen, goes on when one holds after a step, and its end is the run's.
    """
    seen = []
    scenes = story(seen)
    enough = next(scenes)
    hang = Timer(HANG_S, run.stop)
    hang.daemon = True
    hang.start()
    for step in run:
        confirmed = step.tracks.id[step.tracks.status != Status.TENTATIVE]
        seen.append(Seen(step.index, step.time_s, frozenset(confirmed.tolist())))
        if enough(seen):
            enough = next(scenes, None)
            if enough is None:
                run.stop()
    hang.cancel()
    assert enough is None, "waited in vain"
    return seen


def run_until(run, enough):
    """Iterate until the condition on what was seen holds after a step."""
    return play(run, lambda seen: iter([enough]))


def frames(count):
    """Condition: so many frames were tracked."""
    return lambda seen: len(seen) >= count


def rows(count):
    """Condition: there is something to write, so many rows of it."""
    return lambda seen: sum(len(each.tracks) for each in seen) >= count
