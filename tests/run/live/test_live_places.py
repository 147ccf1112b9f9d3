"""Where a live run writes: its state and its recording may lie in the folder of the results."""

from contextlib import ExitStack

import pytest

from vidtrack.errors import ConfigError, OutputError
from vidtrack.run.live.outputs import LiveExtras, lock_extras, lock_folder


def folder_for(output, extras, in_parts=False):
    with ExitStack() as locks:
        lock_extras(extras, output, locks)
        return lock_folder(output, "cam", extras, locks, force=False, in_parts=in_parts)


@pytest.mark.parametrize("in_parts", [False, True])
def test_state_and_recording_may_lie_in_the_folder(tmp_path, in_parts):
    output = tmp_path / "cam"
    extras = LiveExtras(state=output / "cam.state", record=output / "tapes" / "today")
    for _ in range(2):  # the second time after a start that failed: the camera was not there
        assert folder_for(output, extras, in_parts) == output
    extras.state.write_bytes(b"")
    (extras.record / "2026-01-01T00-00-00Z").mkdir()
    assert folder_for(output, extras, in_parts) == output


@pytest.mark.parametrize("in_parts", [False, True])
@pytest.mark.parametrize("name", ["intervals", "outbox", "pictures"])
def test_what_outlasts_runs_is_gone_on_with_where_no_part_is_left(tmp_path, name, in_parts):
    """As after a kill before the first part, or when an operator deleted all parts."""
    (tmp_path / "cam" / name / "2026-11-22").mkdir(parents=True)
    assert folder_for(tmp_path / "cam", LiveExtras(), in_parts) == tmp_path / "cam"


def test_pictures_of_a_user_are_not_taken_for_those_of_events(tmp_path):
    (tmp_path / "cam" / "pictures" / "holiday").mkdir(parents=True)
    with pytest.raises(OutputError, match="not empty"):
        folder_for(tmp_path / "cam", LiveExtras())


def test_what_another_run_left_is_not_written_over(tmp_path):
    output = tmp_path / "cam"
    extras = LiveExtras(state=output / "cam.state")
    folder_for(output, extras)
    (output / "tracks.csv").touch()
    with pytest.raises(OutputError, match="not empty"):
        folder_for(output, extras)


def test_results_and_recording_are_two_folders(tmp_path):
    with pytest.raises(ConfigError, match="--record a folder of its own"):
        folder_for(tmp_path / "cam", LiveExtras(record=tmp_path / "x" / ".." / "cam"))
