"""Where a run stands, so that another one can go on from there."""

from __future__ import annotations

import logging
import time
from pathlib import Path
from threading import Thread
from time import monotonic

from vidtrack.errors import OutputError
from vidtrack.output.folder import usable
from vidtrack.output.linefile import Every
from vidtrack.output.sink import Step
from vidtrack.state import State, gather, read_state, restore, write_state
from vidtrack.tracking.tracker import Tracker
from vidtrack.video.foreground import Background
from vidtrack.video.frame import Frame

log = logging.getLogger(__name__)

_SAVE_S = 10.0
_BLOCK = 10_000  # ids reserved at a time, and numbers of frames: many times more than come between two saves
_NEXT_ID, _FRAME = "tracker.register.next_id", "frame"


class Checkpoint:
    """Everything that the tracks of the next frame depend on.

    like           a frame of the size and kind that all frames are brought to
    frame, time_s  of the last frame; -1 and 0 before the first
    unix_s         when that was
    """

    STATE = ("detector", "tracker", "frame", "time_s", "unix_s", "width", "height", "coloured")

    def __init__(self, detector: Background, tracker: Tracker, like: Frame) -> None:
        self.detector = detector
        self.tracker = tracker
        self.height, self.width = like.shape
        self.coloured = like.u is not None
        self.frame = -1
        self.time_s = 0.0
        self.unix_s = time.time()

    def note(self, step: Step) -> None:
        """This step is the last one now."""
        self.frame, self.time_s, self.unix_s = step.index, step.time_s, time.time()

    def gather(self) -> State:
        """A copy as plain data."""
        return gather(self)

    def restore(self, state: State) -> None:
        """Take over a saved checkpoint. Raises FormatError if other settings made it."""
        restore(self, state)


class NoCheckpointFile:
    """Nothing is saved, where there is no --state."""

    found: State | None = None
    lost = 0

    def offer(self, checkpoint: Checkpoint) -> None:
        """It is not."""

    def close(self, checkpoint: Checkpoint | None, until_s: float) -> None:
        """Nothing is open."""


class CheckpointFile:
    """A checkpoint on the disk, saved regularly. Numbers are reserved there before they are used: none is issued twice.

    found  what an earlier run left; None without one
    lost   times that it could not be saved

    Raises FormatError for a file that is no saved state, OutputError for a place where it cannot be saved; the first
    `offer` raises that too.
    """

    def __init__(self, path: Path) -> None:
        usable(path.parent)
        self.path = path
        self.lost = 0
        self.found = read_state(path) if path.exists() else None
        self._due = Every(_SAVE_S)
        self._reserved = 0
        self._writing: Thread | None = None

    def offer(self, checkpoint: Checkpoint) -> None:
        """Save if it is time, beside the tracker."""
        first, next_id = not self._reserved, checkpoint.tracker.register.next_id
        scarce = self._reserved - next_id < _BLOCK // 2
        if not (scarce or self._due()) or (self._writing is not None and self._writing.is_alive()):
            return
        self._reserved = next_id + _BLOCK
        state = checkpoint.gather() | {_NEXT_ID: self._reserved, _FRAME: checkpoint.frame + _BLOCK}
        if first:
            self._reserve(state)
            return
        self._writing = Thread(target=self._write, args=(state,), name="save-state", daemon=True)
        self._writing.start()

    def close(self, checkpoint: Checkpoint | None, until_s: float) -> None:
        """Save the end, waiting for the disk until a monotonic time; what was reserved in vain is free again.

        checkpoint  None: a frame was broken off, and what was saved before it holds
        """
        if self._writing is not None:
            self._writing.join(max(0.0, until_s - monotonic()))
        if checkpoint is not None:
            self._write(checkpoint.gather())

    def _reserve(self, state: State) -> None:
        """The first save: before it is on the disk, no number may be used."""
        try:
            write_state(self.path, state)
        except OSError as error:
            why = error.strerror or error
            raise OutputError(f"cannot save the state in {self.path}: {why}; choose another file for --state") from None

    def _write(self, state: State) -> None:
        try:
            write_state(self.path, state)
        except OSError as error:
            self.lost += 1
            log.warning("cannot save the state in %s: %s; it is tried again", self.path, error.strerror or error)
