"""Of more pictures a second than are wanted, evenly spaced ones are chosen."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from source_clips import picture, write_clip

from vidtrack.config.settings import SourceSettings
from vidtrack.video.container import VideoFile
from vidtrack.video.max_rate import MaxRate
from vidtrack.video.source import open_part, open_source
from vidtrack.video.stats import SourceStats


def chosen(times, *arguments, **options):
    rate = MaxRate(*arguments, **options)
    return [k for k, time_s in enumerate(times) if rate.chooses(time_s)]


def read(path, opened=open_source, **settings):
    with opened(str(path), SourceSettings(**settings)) as source:
        return [(frame.index, round(frame.time_s, 6)) for frame in source], source


@pytest.mark.parametrize(
    ("fps", "most", "expected"),
    [
        (25, 12.5, [0, 2, 4, 6, 8, 10]),
        (25, 10, [0, 2, 5, 7, 10]),
        (25, 25, list(range(12))),
        (10, 25, list(range(12))),
        (30, None, list(range(12))),
    ],
)
def test_pictures_are_chosen_as_evenly_as_they_come(fps, most, expected):
    assert chosen(np.arange(12) / fps, most) == expected


@given(st.floats(0, 100), st.lists(st.floats(-0.004, 0.004), min_size=60, max_size=60))
def test_jitter_changes_no_choice_where_the_rate_is_a_whole_part(since_s, jitter):
    times = since_s + np.arange(60) / 30 + np.array([0.0, *jitter[1:]])
    assert chosen(times, 15) == list(range(0, 60, 2))


@given(st.lists(st.floats(0.001, 3.0), min_size=1, max_size=80), st.floats(0.2, 30))
def test_there_are_no_more_and_a_slow_source_loses_none(steps, most):
    times = np.cumsum(steps)
    kept = times[chosen(times, most)]
    assert kept[0] == times[0]
    for begin_s in kept:
        window = (kept >= begin_s) & (kept < begin_s + 5.0)
        assert np.count_nonzero(window) <= 5.0 * most + 2
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
    assert frames == [(k, k / 25) for k in (0, 2, 5, 7, 10, 12, 15, 17, 20, 22, 25, 27, 30, 32, 35, 37)]
    assert (source.fps, source.frames, source.stats.frames_read) == (25, 16, 16)
    assert read(path, max_fps=10, start_s=0.15, end_s=0.5)[0] == [(5, 0.2), (7, 0.28), (10, 0.4), (12, 0.48)]


def test_only_what_is_looked_at_is_decoded_where_packets_are_pictures(tmp_path):
    path = write_clip(tmp_path / "clip.avi", 40, "mjpeg", "yuvj420p")
    all_of_it = {index: found for index, _, found in VideoFile(path, SourceSettings(), SourceStats())}
    chosen = list(VideoFile(path, SourceSettings(max_fps=10), SourceStats()))
    assert [index for index, *_ in chosen] == [0, 2, 5, 7, 10, 12, 15, 17, 20, 22, 25, 27, 30, 32, 35, 37]
    for index, _, found in chosen:
        np.testing.assert_array_equal(found.to_ndarray(), all_of_it[index].to_ndarray())


def test_images_between_are_not_read(tmp_path):
    for number in range(10):
        cv2.imwrite(str(tmp_path / f"{number:03d}.png"), picture(number))
    (tmp_path / "003.png").write_bytes(b"damaged")
    frames, source = read(tmp_path, fps=25, max_fps=12.5)
    assert [index for index, _ in frames] == [0, 2, 4, 6, 8]
    assert source.stats.decode_errors == 0


@pytest.mark.parametrize("start_s", [0.4, 0.44, 0.48, 0.8, 1.0])
def test_a_part_has_the_pictures_of_the_whole(tmp_path, start_s):
    path = write_clip(tmp_path / "clip.mp4", 40, "libx264")
    whole = [time_s for _, time_s in read(path, max_fps=10)[0] if time_s >= start_s]
    assert [time_s for _, time_s in read(path, open_part, max_fps=10, start_s=start_s)[0]] == whole


def test_the_opening_is_of_these_pictures_too(tmp_path):
    with open_source(str(write_clip(tmp_path / "clip.avi", 40)), SourceSettings(max_fps=5)) as source:
        assert [round(frame.time_s, 6) for frame in source.opening(0.9, None)] == [0.0, 0.16, 0.36, 0.56, 0.76]
        assert [frame.index for frame in source] == [0, 4, 9, 14, 19, 24, 29, 34, 39]
