"""Checkpoints of a live run: its complete state, saved so that a later run can continue from it."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from threading import Thread
from time import monotonic

from vidtrack.errors import FormatError, OutputError
from vidtrack.output.folder import usable, writing
from vidtrack.output.linefile import Every
from vidtrack.output.sink import Step
from vidtrack.state import State, gather, read_state, restore, write_state
from vidtrack.tracking.tracker import Tracker
from vidtrack.video.foreground import Background
from vidtrack.video.frame import Frame

log = logging.getLogger(__name__)

_SAVE_S = 10.0
_BLOCK = 10_000  # track ids and frame numbers reserved at a time: far more than are used between two saves
_OF_RUNS = {"frame": int, "time_s": float, "unix_s": float, "width": int, "height": int, "coloured": bool}
_NEXT_ID, _FRAME = "tracker.register.next_id", "frame"


class Checkpoint:
    """The complete state on which the next frame's tracks depend.

    like           a frame with the size and colour format of all frames
    frame, time_s  of the last frame; -1 and 0 before the first
    unix_s         Unix time at which it was tracked
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
        """Record the number and time of the last step."""
        self.frame, self.time_s, self.unix_s = step.index, step.time_s, time.time()

    def gather(self) -> State:
        """A copy of the state as plain data."""
        return gather(self)

    def restore(self, state: State) -> None:
        """Set the state from a saved checkpoint. Raises FormatError if it was made with other settings."""
        restore(self, state)


class NoCheckpointFile:
    """Saves nothing: a run without --state."""

    found: State | None = None
    first = 0
    lost = 0
    failing: str | None = None

    def set_aside(self, error: FormatError) -> None:
        """Do nothing: there is no state that could be damaged."""

    def offer(self, checkpoint: Checkpoint) -> None:
        """Do nothing."""

    def close(self, checkpoint: Checkpoint | None, until_s: float) -> None:
        """Do nothing."""


class CheckpointFile:
    """Saves checkpoints to a file at intervals. Ids and frame numbers are reserved in the file before they are used.

    tell     called with what goes wrong
    replace  a state that cannot be used is set aside, and numbers go on far ahead

    found    state saved by an earlier run; None without one
    first    number of the first frame and of the first track, if no state was found
    lost     number of failed saves
    failing  why the last save failed; None: it did not

    Raises FormatError if the file is not a saved state, OutputError if its folder is not writable; the first `offer`
    raises OutputError too.
    """

    def __init__(self, path: Path, tell: Callable[[str], None] = log.warning, replace: bool = False) -> None:
        usable(path.parent)
        self.path = path
        self.lost = 0
        self.failing: str | None = None
        self._tell = tell
        self.first = 0
        self.found: State | None = None
        self._replace = replace
        try:
            self.found = _read(path) if path.exists() else None
        except FormatError as error:
            self.set_aside(error)
        self._due = Every(_SAVE_S)
        self._reserved = 0
        self._writing: Thread | None = None

    def set_aside(self, error: FormatError) -> None:
        """Rename a state that cannot be used, if that is wanted, else raise the error with this way out.

        Nobody knows which numbers were used: the next ones are higher than those of a run that began in 1970, with
        fewer than 100 frames and tracks a second.
        """
        if not self._replace:
            raise FormatError(f"{error}; or set it aside with --set live.replace_state=true") from None
        aside = self.path.with_name(f"{self.path.name}.unusable-{datetime.now(UTC):%Y-%m-%dT%H-%M-%SZ}")
        with writing(self.path):
            self.path.replace(aside)
        self.first = 100 * int(time.time())
        self._tell(f"{error}; it is set aside as {aside.name}, and numbers go on at {self.first}")

    def offer(self, checkpoint: Checkpoint) -> None:
        """Save in a thread if a save is due."""
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
        """Save the final state, which frees unused numbers; wait for a running save until `until_s` (monotonic).

        checkpoint  None: a frame was interrupted, so the last saved state stays
        """
        if self._writing is not None:
            self._writing.join(max(0.0, until_s - monotonic()))
        if checkpoint is not None:
            self._write(checkpoint.gather())

    def _reserve(self, state: State) -> None:
        """Save for the first time, synchronously: no number may be used before it is reserved."""
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
            self.failing = error.strerror or str(error)
            self._tell(f"cannot save the state in {self.path}: {self.failing}; it is tried again")
        else:
            self.failing = None


def _read(path: Path) -> State:
    """The saved state of a live run. Raises FormatError."""
    state = read_state(path)
    for name, kind in _OF_RUNS.items():
        if not isinstance(state.get(name), kind):
            raise FormatError(f"{path} is not the state of a live run; remove it to start anew")
    return state
