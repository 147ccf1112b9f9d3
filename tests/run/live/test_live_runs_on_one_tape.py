"""A recording that several runs wrote into."""

import shutil

from cameras import Picture, Script, crossing, script_of

from vidtrack.config.load import load
from vidtrack.recording.retention import parts_of
from vidtrack.recording.source import Recording
from vidtrack.run.live.outputs import LiveExtras
from vidtrack.run.live.run import LiveRun


def test_a_run_that_numbers_anew_is_told(compiled, tmp_path):
    tape = tmp_path / "tape"
    acts = [act for picture in crossing()[:60] for act in (0.01, Picture(picture[..., 1]))]
    connection = Script(*acts)
    connection.is_raw = True
    settings = load(assignments=["live.every_frame=true"])
    with LiveRun(
        "http://camera/", settings, tmp_path / "out", LiveExtras(record=tape), connect=script_of(connection)
    ) as run:
        for number, _ in enumerate(run):
            if number == 5:
                run.stop()
    (part,) = parts_of(tape)
    alone = Recording(str(tape))
    frames = [frame.index for frame in alone]
    assert not alone.stats.warnings

    shutil.copytree(part, tape / "2100-01-01T00-00-00Z")
    both = Recording(str(tape))
    assert [frame.index for frame in both] == 2 * frames
    (warning,) = both.stats.warnings
    assert "another run begins with" in warning
    assert "2100-01-01" in warning
