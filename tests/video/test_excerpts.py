"""Frames of a span of time are those of a run over the whole source."""

import cv2
import numpy as np
import pytest
from command_line import SAMPLES
from source_clips import picture, write_clip

from vidtrack.config.settings import SourceSettings
from vidtrack.errors import SourceError
from vidtrack.video.source import Excerpts, open_source

SPANS = ((1.1, 1.5), (0.0, 0.2), (2.3, 9.0), (0.4, 0.4001), (1.1, 1.5))


def check(path, **settings):
    """Compare with the whole source, some spans in any order."""
    settings = SourceSettings(**settings)
    with open_source(str(path), settings) as source:
        whole = [(frame.time_s, frame.y.copy()) for frame in source]
    excerpts = Excerpts(str(path), settings)
    for begin, end in SPANS:
        wanted = [(t, y) for t, y in whole if begin <= t <= end]
        found = list(excerpts.between(begin, end))
        assert [frame.time_s for frame in found] == pytest.approx([t for t, _ in wanted])
        assert all(np.array_equal(frame.y, y) for frame, (_, y) in zip(found, wanted, strict=True))
    excerpts.close()


@pytest.mark.parametrize(
    ("name", "more"),
    [
        ("a.mp4", {"codec": "libx264"}),
        ("a.avi", {"codec": "mpeg4"}),
        ("a.avi", {"codec": "mjpeg", "pixels": "yuvj420p"}),
        ("a.mkv", {"codec": "libx264", "stamps_ms": [*range(700, 2000, 40), *range(2600, 3500, 50)]}),
        ("a.264", {"codec": "libx264"}),
    ],
    ids=["h264", "avi", "mjpeg", "later stamps and a gap", "without an index"],
)
def test_spans_of_a_video(tmp_path, name, more):
    check(write_clip(tmp_path / name, frames=70, **more))


def test_spans_at_a_rate_that_the_user_states(tmp_path):
    check(write_clip(tmp_path / "a.avi", frames=70), fps=20)


def test_spans_of_the_sample():
    check(SAMPLES / "junction.avi")


def test_spans_of_images(tmp_path):
    for index in range(30):
        cv2.imwrite(str(tmp_path / f"{index}.png"), picture(index))
    check(tmp_path, fps=10)


def test_a_source_that_is_gone(tmp_path):
    with pytest.raises(SourceError, match="no such file"):
        Excerpts(str(tmp_path / "gone.avi"), SourceSettings())


@pytest.mark.parametrize(
    ("name", "codec", "fewer"),
    [("a.mp4", "libx264", True), ("a.mkv", "libx264", True), ("a.264", "libx264", False), ("a.avi", "mpeg4", False)],
)
def test_an_opening_has_all_pictures_that_lie_so_far_apart_and_fewer_others(tmp_path, monkeypatch, name, codec, fewer):
    monkeypatch.setattr("vidtrack.video.source._KEPT_BYTES", 0)  # it is read a second time
    path, settings = write_clip(tmp_path / name, frames=70, codec=codec, spare=2), SourceSettings(start_s=0.4)
    with open_source(str(path), settings) as source:
        every = list(source.opening(1.0, None))
        some = {frame.time_s: frame.y for frame in source.opening(1.0, None, 0.2)}
    last_s = -1.0
    for frame in every:
        if frame.time_s > last_s + 0.2 - 1e-6:
            last_s = frame.time_s
            assert np.array_equal(some.pop(last_s), frame.y)
    assert 0.4 <= last_s <= 1.4
    assert (len(some) < len(every) - 6) == fewer  # six lie so far apart
