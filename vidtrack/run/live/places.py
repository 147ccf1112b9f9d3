"""Where a live run writes: places that no other run has at the same time."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path

from vidtrack.errors import ConfigError
from vidtrack.output.folder import open_run, usable
from vidtrack.output.lock import exclusive, lock_file
from vidtrack.run.live.outputs import LiveExtras
from vidtrack.run.live.retention import parts_of


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
    output: Path | None, name: str, extras: LiveExtras, locks: ExitStack, *, force: bool, in_blocks: bool
) -> Path:
    """A new folder, or that of an earlier run in parts, which is continued; other runs are kept out.

    The state and the recording may lie in it. Raises OutputError.
    """
    if output is not None:
        locks.enter_context(exclusive(usable(output)))  # before `force` deletes what another one writes
        continued = in_blocks and parts_of(output)
        return output if continued or _is_ours(output, extras) else open_run(output, name, force)
    folder = open_run(None, name, force)
    locks.enter_context(exclusive(folder))
    return folder


def _is_ours(folder: Path, extras: LiveExtras) -> bool:
    """Whether nothing is in a folder but what this run keeps there."""
    kept = [extras.record] if extras.record else []
    kept += [extras.state, lock_file(extras.state)] if extras.state else []
    return all(any(path.resolve().is_relative_to(entry.resolve()) for path in kept) for entry in folder.iterdir())
