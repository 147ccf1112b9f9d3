"""Everything that a live run writes, each beside the tracker."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from pathlib import Path
from time import monotonic

from vidtrack.output.confirmed import LIVE_HOLD_S, Confirmed
from vidtrack.output.sink import Sink
from vidtrack.run.live.beside import Beside
from vidtrack.run.live.part import Part
from vidtrack.run.live.parts import Parts
from vidtrack.run.live.retention import Retention
from vidtrack.run.run import Extras
from vidtrack.run.sinks import Subject, picture_sinks

_WRITE_S = 0.25  # between two writes: with LIVE_HOLD_S this is what a kill costs
_ROWS_DEPTH = 1000  # steps without pictures that may wait for a slow disk
_LEAST_S = 0.2  # that each output gets to end, however late it is


@dataclass(frozen=True, slots=True)
class LiveExtras(Extras):
    """What a live run writes beside its tables.

    state   file that the next run goes on from
    record  folder for what the camera sends
    """

    state: Path | None = None
    record: Path | None = None


class Outputs:
    """All results in `folder`, and the extras. Raises OutputError at the start, later it counts losses.

    sinks  take the steps
    """

    def __init__(
        self, folder: Path, subject: Subject, extras: Extras, roll_s: float | None, retention: Retention
    ) -> None:
        self._besides = [Beside.of(name, sink) for name, sink in picture_sinks(subject, extras)]
        # The last, so that what cannot be opened above leaves the folder empty.
        parts = Parts(folder, subject, partial(Part, subject, extras.decisions), roll_s, retention)
        tables = Beside("results", parts.write, parts.finish, _WRITE_S, _ROWS_DEPTH)
        self.sinks: list[Sink] = [*self._besides, Confirmed(tables, hold_s=LIVE_HOLD_S)]
        self._besides.append(tables)

    @property
    def lost(self) -> dict[str, int]:
        """Frames that each output could not write."""
        return {beside.name: beside.lost for beside in self._besides}

    def close(self, until_s: float) -> None:
        """Finish all by a monotonic time; what is not finished then stays as it is, and valid."""
        for sink in self.sinks:
            sink.close()
        for beside in reversed(self._besides):  # the tables first
            beside.join(max(_LEAST_S, until_s - monotonic()))
