"""All outputs of a live run: locked against other runs, and written in threads of their own."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from time import monotonic

from vidtrack.errors import ConfigError
from vidtrack.output.confirmed import LIVE_HOLD_S, Confirmed
from vidtrack.output.events.event import PICTURES
from vidtrack.output.folder import open_run, usable
from vidtrack.output.intervals.day import day_folders
from vidtrack.output.lock import exclusive, lock_file
from vidtrack.output.sink import Sink
from vidtrack.recording.event_pictures import EventPictures
from vidtrack.recording.reserve import Reserve
from vidtrack.recording.retention import Retention, parts_of
from vidtrack.run.live.background_writer import BackgroundWriter
from vidtrack.run.live.counting import COUNTS, Counting
from vidtrack.run.live.events import OUTBOX, LiveEvents, Receivers
from vidtrack.run.live.parts import Parts
from vidtrack.run.live.site import FollowedSite
from vidtrack.run.run import Extras
from vidtrack.run.sinks import Subject, picture_sinks

_WRITE_S = 0.25  # between two writes: a kill loses this and LIVE_HOLD_S
_ROWS_DEPTH = 1000  # queued steps, without pictures
_LEAST_S = 0.2  # least time for each output to finish


@dataclass(frozen=True, slots=True)
class LiveExtras(Extras):
    """Optional outputs of a live run.

    state   checkpoint file, from which the next run continues
    record  folder of the recording
    lasting    folder of what outlasts a run: counts by interval, events that wait, their pictures; None: that of the
               results
    receivers  of events
    """

    state: Path | None = None
    record: Path | None = None
    lasting: Path | None = None
    receivers: Receivers = field(default_factory=Receivers)


class Outputs:
    """Writes the results in `folder` and the extras.

    sinks  receive the steps

    The constructor raises OutputError; later write errors are counted in `lost`.
    """

    def __init__(
        self,
        folder: Path,
        subject: Subject,
        extras: Extras,
        roll_s: float | None,
        retention: Retention,
        counting: Counting | None,
        tell: Callable[[str], None],
        site: FollowedSite | None,
        events: LiveEvents | None = None,
        pictures: EventPictures | None = None,
    ) -> None:
        self._counting = counting
        self._writers = [BackgroundWriter.of(name, sink, tell) for name, sink in picture_sinks(subject, extras)]
        # Opened last: if an extra above cannot be opened, the folder stays empty.
        reserve = Reserve(subject.settings.live.reserve_bytes)
        parts = Parts(folder, subject, extras.decisions, roll_s, retention, counting, reserve, site, events)
        tables = BackgroundWriter("results", parts.write, parts.finish, _WRITE_S, _ROWS_DEPTH, tell)
        self.sinks: list[Sink] = [*self._writers, Confirmed(tables, hold_s=LIVE_HOLD_S)]
        self.sinks += [] if pictures is None else [pictures]
        self._writers.append(tables)

    @property
    def lost(self) -> dict[str, int]:
        """Number of frames not written, by output; and of crossings."""
        counts = {} if self._counting is None else {"counts": self._counting.lost}
        return {writer.name: writer.lost for writer in self._writers} | counts

    @property
    def failing(self) -> dict[str, str]:
        """Why an output cannot be written now, by output."""
        return {writer.name: writer.failing for writer in self._writers if writer.failing is not None}

    def close(self, until_s: float) -> None:
        """Finish all outputs by `until_s` (monotonic); unfinished files stay valid."""
        for sink in self.sinks:
            sink.close()
        for writer in reversed(self._writers):  # the tables first
            writer.join(max(_LEAST_S, until_s - monotonic()))


def lock_extras(extras: LiveExtras, output: Path | None, locks: ExitStack) -> None:
    """Lock the state file and the recording against other runs. Raises ConfigError, OutputError."""
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
    """A locked folder for the results: a new one, or that of an earlier run in parts, which is continued.

    The state file and the recording may lie in it. Raises OutputError.
    """
    if output is not None:
        locks.enter_context(exclusive(usable(output)))  # before `force` deletes the files of another run
        continued = in_parts and parts_of(output)
        return output if continued or _is_ours(output, extras) else open_run(output, name, force)
    folder = open_run(None, name, force)
    locks.enter_context(exclusive(folder))
    return folder


def _is_ours(folder: Path, extras: LiveExtras) -> bool:
    """Whether a folder contains at most what outlasts runs, and this run's state file and recording."""
    kept = [folder / name for name in (COUNTS, OUTBOX, PICTURES)]
    kept += [extras.record] if extras.record else []
    kept += [extras.state, lock_file(extras.state)] if extras.state else []
    pictures = folder / PICTURES
    if pictures.is_dir() and set(pictures.iterdir()) != set(day_folders(pictures)):
        return False  # a user's own: ours are deleted beyond their limits
    return all(any(path.resolve().is_relative_to(entry.resolve()) for path in kept) for entry in folder.iterdir())
