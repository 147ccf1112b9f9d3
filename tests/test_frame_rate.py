"""Errors that last: as many frames as one likes make a track no surer than it can be, and lose nobody."""

import numpy as np
import pytest
from command_line import SAMPLES

from vidtrack import formats, score
from vidtrack.config.settings import Settings
from vidtrack.papers.p004.clips import by_default
from vidtrack.run.files import run_file
from vidtrack.simulate import simulate
from vidtrack.tracks import TENTATIVE


def followed(scenario, seed, fps):
    """The boxes of confirmed tracks in a simulated clip, in the frames that it has at 10 frames/s too."""
    steps = by_default(simulate(scenario, seed=seed, fps=fps))[:: fps // 10]
    seen = [tracks.only(tracks.seen & (tracks.status != TENTATIVE)) for tracks in steps]
    frame = np.repeat(np.arange(len(seen)), [len(tracks) for tracks in seen])
    return formats.box_table(
        frame, np.concatenate([tracks.id for tracks in seen]), np.concatenate([tracks.box for tracks in seen])
    )


@pytest.mark.parametrize(("scenario", "seed"), [("crossing", 0), ("crossing", 5), ("junction", 2)])
def test_ten_and_thirty_frames_a_second_tell_the_same(scenario, seed):
    slow, fast = (followed(scenario, seed, fps) for fps in (10, 30))
    assert score.evaluate(fast, slow, iou=0.3)["idf1"] > 0.93


def test_the_sample_errs_as_much_as_its_covariances_say(tmp_path):
    """NEES of two coordinates: 2 where P is right, 4.2 when lasting errors are taken for new ones; less is cautious."""
    with run_file(str(SAMPLES / "junction.avi"), Settings(), tmp_path / "out") as run:
        for _ in run:
            pass
    found = formats.read(tmp_path / "out")
    truth = formats.read(SAMPLES / "junction.txt")
    scores = score.evaluate(found, truth, iou=0.5, states=formats.read_states(tmp_path / "out"))
    assert 1.1 < scores["nees"] < 2.5
    assert scores["tracks"] == scores["truth_tracks"] == 14
    assert scores["switches"] == 0
