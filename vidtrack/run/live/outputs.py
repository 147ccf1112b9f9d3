"""Everything that a live run writes: where no other run writes at the same time, and beside the tracker."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from time import monotonic

from vidtrack.errors import ConfigError
from vidtrack.output.confirmed import LIVE_HOLD_S, Confirmed
from vidtrack.output.folder import open_run, usable
from vidtrack.output.lock import exclusive, lock_file
from vidtrack.output.sink import Sink
from vidtrack.recording.retention import Retention, parts_of
from vidtrack.run.live.background_writer import BackgroundWriter
from vidtrack.run.live.parts import Parts
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
        self._writers = [BackgroundWriter.of(name, sink) for name, sink in picture_sinks(subject, extras)]
        # The last, so that what cannot be opened above leaves the folder empty.
        parts = Parts(folder, subject, extras.decisions, roll_s, retention)
        tables = BackgroundWriter("results", parts.write, parts.finish, _WRITE_S, _ROWS_DEPTH)
        self.sinks: list[Sink] = [*self._writers, Confirmed(tables, hold_s=LIVE_HOLD_S)]
        self._writers.append(tables)

    @property
    def lost(self) -> dict[str, int]:
        """Frames that each output could not write."""
        return {writer.name: writer.lost for writer in self._writers}

    def close(self, until_s: float) -> None:
        """Finish all by a monotonic time; what is not finished then stays as it is, and valid."""
        for sink in self.sinks:
            sink.close()
        for writer in reversed(self._writers):  # the tables first
            writer.join(max(_LEAST_S, until_s - monotonic()))


def lock_extras(extras: LiveExtras, output: Path | None, locks: ExitStack) -> None:
    """Keep other runs off the files that this one continues. Raises ConfigError, OutputError."""
    if extras.state is not None:
        usable(extras.state.parent)
        locks.enter_context(exclusive(extras.state))
    if extras.record is not None:
        if output is not None and output.resolve() == extras.record.resolve():
            raise ConfigError(f"{output} cannot take results and recording; give --record a folder of its own")
        locks.enter_context(exclusive(usable(extras.record)))


def lock_folder(
    output: Path | None, name: str, extras: LiveExtras, locks: ExitStack, *, force: bool, in_parts: bool
) -> Path:
    """A new folder, or that of an earlier run in parts, which is continued; other runs are kept out.

    The state and the recording may lie in it. Raises OutputError.
    """
    if output is not None:
        locks.enter_context(exclusive(usable(output)))  # before `force` deletes what another one writes
        continued = in_parts and parts_of(output)
        return output if continued or _is_ours(output, extras) else open_run(output, name, force)
    folder = open_run(None, name, force)
    locks.enter_context(exclusive(folder))
    return folder


def _is_ours(folder: Path, extras: LiveExtras) -> bool:
    """Whether nothing is in a folder but what this run keeps there."""
    kept = [extras.record] if extras.record else []
    kept += [extras.state, lock_file(extras.state)] if extras.state else []
    return all(any(path.resolve().is_relative_to(entry.resolve()) for path in kept) for entry in folder.iterdir())
