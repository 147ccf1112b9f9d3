"""Of more pictures a second than are wanted, evenly spaced ones are chosen."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from source_clips import picture, write_clip

from vidtrack.config.settings import SourceSettings
from vidtrack.errors import SourceError
from vidtrack.video.max_rate import MaxRate
from vidtrack.video.source import open_part, open_source


def chosen(times, *arguments, **options):
    rate = MaxRate(*arguments, **options)
    return [k for k, time_s in enumerate(times) if rate.chooses(time_s)]


def read(path, opened=open_source, **settings):
    with opened(str(path), SourceSettings(**settings)) as source:
        return [(frame.index, round(frame.time_s, 6)) for frame in source], source


@pytest.mark.parametrize(
    ("fps", "most", "expected"),
    [(25, 12.5, 12.5), (25, 10, 25 / 3), (30, 29, 15), (25, 25, 25), (10, 25, 10), (30.02, 15, 15.01)],
)
def test_every_nth_picture_of_a_known_rate_is_looked_at(fps, most, expected):
    looked_at = SourceSettings(max_fps=most).looked_at_fps(fps)
    assert looked_at == pytest.approx(expected)
    assert chosen(np.arange(30) / fps, looked_at, fps, 0.0) == list(range(0, 30, round(fps / looked_at)))


@pytest.mark.parametrize("ratio", range(1, 9))
@given(st.floats(0, 100), st.lists(st.floats(-0.3, 0.3), min_size=60, max_size=60))
def test_jitter_changes_no_choice_where_the_rate_is_a_whole_part(ratio, since_s, jitter):
    """Jitter of up to 0.3 of the time between two pictures."""
    times = since_s + (np.arange(60) + np.array([0.0, *jitter[1:]])) / 30
    assert chosen(times, 30 / ratio, 30, since_s) == list(range(0, 60, ratio))


@given(st.lists(st.floats(0.001, 3.0), min_size=1, max_size=80), st.floats(1, 30))
def test_there_are_no_more_and_a_slow_source_loses_none(steps, most):
    times = np.cumsum(steps)
    kept = times[chosen(times, most)]
    assert kept[0] == times[0]
    for begin_s in kept:
        assert np.count_nonzero((kept >= begin_s) & (kept < begin_s + 5.0)) <= 5.0 * most + 2
    after_long = np.flatnonzero(np.diff(times) > 1.0 / most + 1e-9) + 1
    assert np.isin(times[after_long], kept).all()


@pytest.mark.parametrize(
    ("name", "codec", "pixels"),
    [
        ("clip.avi", "mpeg4", "yuv420p"),
        ("clip.mp4", "libx264", "yuv420p"),
        ("clip.avi", "mjpeg", "yuvj420p"),
        ("clip.mkv", "mjpeg", "yuvj420p"),
    ],
)
def test_frames_of_a_file_keep_numbers_and_times(tmp_path, name, codec, pixels):
    path = write_clip(tmp_path / name, 40, codec, pixels)
    frames, source = read(path, max_fps=10)
    assert frames == [(k, k / 25) for k in range(0, 40, 3)]
    assert (source.fps, source.frames, source.stats.frames_read) == (25, 14, 14)
    assert read(path, max_fps=10, start_s=0.15, end_s=0.5)[0] == [(6, 0.24), (9, 0.36), (12, 0.48)]


def test_images_between_are_not_read(tmp_path):
    for number in range(10):
        cv2.imwrite(str(tmp_path / f"{number:03d}.png"), picture(number))
    (tmp_path / "003.png").write_bytes(b"damaged")
    frames, source = read(tmp_path, fps=25, max_fps=12.5)
    assert [index for index, _ in frames] == [0, 2, 4, 6, 8]
    assert source.stats.decode_errors == 0


VARIABLE_MS = np.cumsum([0, *[40, 40, 20, 90, 40, 35, 45, 120, 40, 40] * 6]).tolist()


@pytest.mark.parametrize("start_s", [0.4, 0.44, 0.48, 0.8, 1.0, 2.3])
@pytest.mark.parametrize("stamps", [None, VARIABLE_MS], ids=["constant", "variable"])
def test_a_part_has_the_pictures_of_the_whole(tmp_path, start_s, stamps):
    path = write_clip(tmp_path / "clip.mp4", 70, "libx264", stamps_ms=stamps)
    whole, _ = read(path, max_fps=7)
    found, source = read(path, open_part, max_fps=7, start_s=start_s)
    expected = [frame for frame in whole if frame[1] >= start_s - 1e-6]
    assert [time_s for _, time_s in found] == [time_s for _, time_s in expected]
    shift = expected[0][0] - found[0][0]
    assert [index + shift for index, _ in found] == [index for index, _ in expected]
    assert whole[len(whole) - len(expected) - 1][0] == source.before + shift


@pytest.mark.parametrize("room", [200_000_000, 0], ids=["kept", "read twice"])
@pytest.mark.parametrize(("name", "codec"), [("clip.avi", "mpeg4"), ("clip.mp4", "libx264")])
def test_the_opening_is_of_these_pictures_too(tmp_path, monkeypatch, room, name, codec):
    monkeypatch.setattr("vidtrack.video.source._KEPT_BYTES", room)
    path = str(write_clip(tmp_path / name, 40, codec, spare=2))
    with open_source(path, SourceSettings(max_fps=5, start_s=0.3)) as source:
        times = [round(frame.time_s, 6) for frame in source.opening(0.9, None, 0.2)]
        assert times == [0.4, 0.6, 0.8, 1.0, 1.2]
        assert [frame.index for frame in source] == [10, 15, 20, 25, 30, 35]


def test_a_span_without_a_picture_to_look_at_says_so(tmp_path):
    with pytest.raises(SourceError, match=r"no frame to look at between 0.04 s and 0.5 s"):
        read(write_clip(tmp_path / "clip.avi", 40), max_fps=1, start_s=0.04, end_s=0.5)
