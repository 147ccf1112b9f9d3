"""What is said while tracking goes on about what the tracker cannot do."""

import numpy as np
import pytest

from vidtrack.config.video import DetectorSettings
from vidtrack.tracking.picture.road import Road
from vidtrack.video.background import create
from vidtrack.video.blobs.limits import LimitChecks
from vidtrack.video.foreground import Foreground
from vidtrack.video.frame import Frame

EMPTY = np.zeros((120, 160), np.uint8)


def said(level, road, seconds=20):
    """All that is said in so many seconds of pictures of this luminance."""
    checks, foreground = LimitChecks(), Foreground(EMPTY, EMPTY.astype(np.float32), 1)
    pictures = (Frame(k, 0.2 * k, np.full((120, 160), level, np.uint8)) for k in range(5 * seconds))
    return [what for frame in pictures for what in checks.look(frame, foreground, road)]


def test_a_dark_picture_is_said_once():
    assert len([what for what in said(20, Road(160, 120)) if "black" in what]) == 1


def test_noise_is_dark_whether_or_not_the_picture_comes_reduced():
    detector, told = create(DetectorSettings(), 0.5), []
    noise = np.random.default_rng(3).normal(26, 12, (30, 120, 160)).clip(0, 255).astype(np.uint8)
    for reduced in (False, True):
        checks = LimitChecks()
        frames = [Frame(k, float(k), picture) for k, picture in enumerate(noise)]
        shown = [detector.reduced(frame) for frame in frames] if reduced else frames
        half = Foreground(EMPTY[::2, ::2], EMPTY[::2, ::2].astype(np.float32), 2)
        told.append([(frame.index, what) for frame in shown for what in checks.look(frame, half, Road(160, 120))])
    assert told[0] == told[1]
    assert len(told[0]) == 1


def test_an_ordinary_picture_is_not_worth_a_word():
    assert said(90, Road(160, 120)) == []


@pytest.mark.parametrize(("share", "times"), [(0.5, 1), (0.1, 0)])
def test_a_restless_picture_is_said_once(share, times):
    road = Road(160, 120)
    starts = road.restless.starts
    starts[: round(share * len(starts))] = 10
    assert len([what for what in said(90, road) if "traffic" in what]) == times


def test_what_does_not_last_is_not_said():
    assert said(20, Road(160, 120), seconds=3) == []
