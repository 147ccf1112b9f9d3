"""Frames from video files: every one, in order, with its own time."""

from __future__ import annotations

import os
import struct
import threading
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from source_clips import level, picture, write_clip

from vidtrack.config.settings import SourceSettings
from vidtrack.errors import SourceError
from vidtrack.video.source import duration_s, open_source

DEFAULTS = SourceSettings()


def read(path, **settings):
    with open_source(str(path), SourceSettings(**settings)) as source:
        return list(source), source


def times(frames):
    return [frame.time_s for frame in frames]


def full_level(frame):
    """Mean luminance on the scale 0..255."""
    mean = float(frame.y.mean())
    return mean if frame.full_range else (mean - 16) * 255 / 219


@pytest.mark.parametrize(
    ("name", "codec", "pixels"),
    [
        ("xvid.avi", "mpeg4", "yuv420p"),
        ("mjpg.avi", "mjpeg", "yuvj420p"),
        ("raw.avi", "rawvideo", "bgr24"),
        ("planes.avi", "rawvideo", "yuv420p"),
        ("grey.avi", "rawvideo", "gray"),
        ("h264.avi", "libx264", "yuv420p"),
        ("h264.mp4", "libx264", "yuv420p"),
        ("h264.mkv", "libx264", "yuv420p"),
        ("mjpg.mkv", "mjpeg", "yuvj422p"),
        ("ten_bit.mkv", "libx264", "yuv420p10le"),
        ("full_chroma.mkv", "libx264", "yuv444p"),
        ("stream.ts", "libx264", "yuv420p"),
    ],
)
def test_every_frame_comes_once_in_order_with_its_time(tmp_path, name, codec, pixels):
    frames, source = read(write_clip(tmp_path / name, 30, codec, pixels))
    assert [frame.index for frame in frames] == list(range(30))
    np.testing.assert_allclose(times(frames), np.arange(30) / 25, atol=1e-4)
    np.testing.assert_allclose([full_level(frame) for frame in frames], [level(i) for i in range(30)], atol=3)
    assert (source.width, source.height, source.fps) == (64, 48, 25)
    assert (source.stats.frames_read, source.stats.decode_errors, source.stats.truncated) == (30, 0, False)
    assert source.stats.warnings == []


@pytest.mark.parametrize("fourcc", ["XVID", "DIVX", "MJPG"])
def test_avi_written_by_opencv(tmp_path, fourcc):
    path = tmp_path / "clip.avi"
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter_fourcc(*fourcc), 12.5, (64, 48))
    for index in range(9):
        writer.write(picture(index))
    writer.release()
    frames, source = read(path)
    assert times(frames) == pytest.approx(np.arange(9) / 12.5)
    assert source.fps == 12.5


@pytest.mark.parametrize("size", [(65, 49), (66, 47), (2, 2), (3840, 2160)])
def test_odd_sizes_and_4k(tmp_path, size):
    width, height = size
    frames, _ = read(write_clip(tmp_path / "clip.avi", 3, "mjpeg", "yuvj444p", size))
    for frame in frames:
        assert frame.shape == (height, width)
        assert frame.u.shape == frame.v.shape == ((height + 1) // 2, (width + 1) // 2)


def test_a_grey_source_has_no_chroma(tmp_path):
    frames, _ = read(write_clip(tmp_path / "clip.avi", 2, "rawvideo", "gray"))
    assert frames[0].u is None
    assert frames[0].v is None


@pytest.mark.parametrize("name", ["variable.mkv", "variable.mp4"])
def test_variable_rate_and_gaps_are_kept_and_time_starts_at_0(tmp_path, name):
    stamps = [1000, 1033, 1100, 1500, 1510, 9000, 9040]
    frames, _ = read(write_clip(tmp_path / name, codec="libx264", stamps_ms=stamps))
    np.testing.assert_allclose(times(frames), (np.array(stamps) - 1000) / 1000, atol=1e-4)


def test_pictures_left_out_of_an_avi_leave_a_gap(tmp_path):
    stamps = [0, 40, 80, 400, 440]
    frames, source = read(write_clip(tmp_path / "gap.avi", codec="mjpeg", pixels="yuvj420p", stamps_ms=stamps))
    assert times(frames) == pytest.approx([0, 0.04, 0.08, 0.4, 0.44])
    assert [frame.index for frame in frames] == [0, 1, 2, 3, 4]
    assert source.fps == pytest.approx(25)  # the file's header says 1000


def test_duplicate_timestamps_are_spread(tmp_path):
    stamps = [0, 0, 80, 80, 160, 160, 240, 240]
    frames, _ = read(write_clip(tmp_path / "pairs.mkv", codec="ffv1", stamps_ms=stamps))
    np.testing.assert_allclose(times(frames), np.arange(8) * 0.04, atol=2e-3)


def patched(path: Path, chunk: bytes, offset: int, value: int) -> Path:
    """Overwrite a 32-bit field of the first `chunk` of an AVI header."""
    data = bytearray(path.read_bytes())
    start = data.index(chunk) + 8 + offset
    data[start : start + 4] = value.to_bytes(4, "little")
    path.write_bytes(data)
    return path


RATE, LENGTH = (b"strh", 24), (b"strh", 32)
PERIOD_US, TOTAL_FRAMES = (b"avih", 0), (b"avih", 16)


@pytest.fixture
def avi(tmp_path):
    """10 frames at 10 frames/s; the rate is stored as 10 / 1."""
    return write_clip(tmp_path / "clip.avi", 10, rate=10)


def test_header_rate_0_falls_back_on_the_other_statement_of_the_header(avi):
    frames, source = read(patched(avi, *RATE, 0))
    assert source.fps == 10
    assert times(frames) == pytest.approx(np.arange(10) / 10)


def test_header_rate_1000_is_not_believed(avi):
    frames, source = read(patched(avi, *RATE, 1000))
    assert source.fps == 10
    assert times(frames) == pytest.approx(np.arange(10) / 10)


@pytest.mark.parametrize(("rate", "period_us"), [(1000, 1000), (0, 0)])
def test_a_rate_stated_nowhere_is_assumed_with_a_warning_or_given(avi, rate, period_us):
    patched(patched(avi, *RATE, rate), *PERIOD_US, period_us)
    frames, source = read(avi)
    assert times(frames) == pytest.approx(np.arange(10) / 25)
    assert "--fps" in source.stats.warnings[0]
    assert duration_s(str(avi)) == pytest.approx(10 / 25)
    frames, source = read(avi, fps=5)
    assert times(frames) == pytest.approx(np.arange(10) / 5)
    assert source.stats.warnings == []


def test_who_asks_for_the_length_is_not_warned_once_more(avi, caplog):
    patched(patched(avi, *RATE, 0), *PERIOD_US, 0)
    assert duration_s(str(avi)) is not None
    assert not caplog.text


@pytest.mark.parametrize("count", [0, 3, 9999])
def test_a_wrong_frame_count_changes_nothing(avi, count):
    frames, source = read(patched(patched(avi, *LENGTH, count), *TOTAL_FRAMES, count))
    assert len(frames) == 10
    assert not source.stats.truncated
    assert source.stats.warnings == []


def test_the_users_rate_overrules_and_keeps_gaps(tmp_path):
    path = write_clip(tmp_path / "gap.mkv", codec="ffv1", stamps_ms=[0, 40, 80, 400])
    assert times(read(path, fps=50)[0]) == pytest.approx([0, 0.02, 0.04, 0.2])


def test_start_and_end_are_media_seconds_and_the_index_keeps_counting(avi):
    frames, source = read(avi, start_s=0.3, end_s=0.6)
    assert [frame.index for frame in frames] == [3, 4, 5, 6]
    assert times(frames) == pytest.approx([0.3, 0.4, 0.5, 0.6])
    np.testing.assert_allclose([full_level(frame) for frame in frames], [level(i) for i in range(3, 7)], atol=3)
    assert (source.frames, source.stats.frames_read) == (4, 4)


def test_a_span_behind_the_end_is_an_error_that_names_the_last_time(avi):
    with open_source(str(avi), SourceSettings(start_s=60)) as source, pytest.raises(SourceError, match=r"0\.9 s"):
        next(source)


ONE = 1 << 16  # 1 in the matrix of an MP4 track, which says how its pictures are to be turned
UPRIGHT, HALF = (ONE, 0, 0, 0, ONE), (-ONE, 0, 0, 0, -ONE)
CLOCKWISE, COUNTERCLOCKWISE = (0, ONE, 0, -ONE, 0), (0, -ONE, 0, ONE, 0)
UNSET = (0, 0, 0, 0, 0)


@pytest.mark.parametrize("pixels", ["yuv420p", "gray"])
@pytest.mark.parametrize(
    ("matrix", "turns"), [(UPRIGHT, 0), (UNSET, 0), (COUNTERCLOCKWISE, 1), (HALF, 2), (CLOCKWISE, 3)]
)
def test_a_turned_video_comes_upright(tmp_path, pixels, matrix, turns):
    path = write_clip(tmp_path / "phone.mp4", 1, "libx264", pixels, (66, 49) if pixels == "gray" else (66, 50))
    (before,), _ = read(path)
    data = bytearray(path.read_bytes())
    start = data.index(b"tkhd") + 44
    data[start : start + 20] = struct.pack(">5i", *matrix)
    path.write_bytes(data)
    (after,), source = read(path)
    assert (source.height, source.width) == after.shape
    for name in ("y", "u", "v"):
        plane = getattr(before, name)
        if plane is not None:
            np.testing.assert_array_equal(getattr(after, name), np.rot90(plane, turns))


def test_one_frame_video(tmp_path):
    frames, source = read(write_clip(tmp_path / "one.avi", 1))
    assert [(frame.index, frame.time_s) for frame in frames] == [(0, 0)]
    assert not source.stats.truncated


def join_packets(path, *parts):
    with av.open(str(path), "w") as target:
        stream, tick = None, 0
        for part in parts:
            with av.open(str(part)) as clip:
                stream = stream or target.add_stream_from_template(clip.streams.video[0])
                for packet in clip.demux(video=0):
                    if packet.size:
                        packet.stream, packet.pts, packet.dts = stream, tick, tick
                        target.mux(packet)
                        tick += 1
    return path


def test_pictures_of_another_size_are_scaled_to_the_first(tmp_path):
    """Motion JPEG allows every picture its own size."""
    path = tmp_path / "clip.avi"
    write_clip(path, 6, "mjpeg", "yuvj420p", (64, 48))
    large = write_clip(tmp_path / "large.avi", 6, "mjpeg", "yuvj420p", (128, 96))
    joined = join_packets(tmp_path / "joined.avi", path, large)
    frames, source = read(joined)
    assert [frame.shape for frame in frames] == [(48, 64)] * 12
    assert [frame.u.shape for frame in frames] == [(24, 32)] * 12
    np.testing.assert_allclose([full_level(frame) for frame in frames], [level(i % 6) for i in range(12)], atol=3)
    assert [warning for warning in source.stats.warnings if "128x96" in warning] == source.stats.warnings
    assert len(source.stats.warnings) == 1


def test_planes_are_views_that_outlive_the_source_and_cannot_be_written(tmp_path):
    frames, _ = read(write_clip(tmp_path / "clip.mp4", 40, "libx264"))
    np.testing.assert_allclose([full_level(frame) for frame in frames], [level(i) for i in range(40)], atol=3)
    assert not frames[0].y.flags.owndata
    with pytest.raises(ValueError, match="read-only"):
        frames[0].y[0, 0] = 0


def test_close_stops_the_thread_at_any_time(tmp_path):
    path = str(write_clip(tmp_path / "clip.avi", 200))
    before = threading.active_count()
    for consumed in (0, 1, 50):
        source = open_source(path, DEFAULTS)
        for _ in range(consumed):
            next(source)
        source.close()
        source.close()
        assert threading.active_count() == before
        assert list(source) == []


def test_an_interrupt_leaves_no_thread_behind(tmp_path):
    path = str(write_clip(tmp_path / "clip.avi", 200))
    before = threading.active_count()

    def interrupted():
        with open_source(path, DEFAULTS) as source:
            for _ in source:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert threading.active_count() == before


def test_reading_ahead_is_bounded(tmp_path):
    source = open_source(str(write_clip(tmp_path / "clip.avi", 100, "rawvideo", "bgr24")), DEFAULTS)
    with source:
        assert len(source._ahead._ahead) <= 4
        next(source)
        assert len(source._ahead._ahead) <= 4


def test_name_with_a_colon_is_not_a_protocol(tmp_path):
    path = write_clip(tmp_path / "clip.avi", 3).rename(tmp_path / "12:30:00.avi")
    assert len(read(path)[0]) == 3


@pytest.mark.skipif("VIDTRACK_DATA" not in os.environ, reason="needs the real data: set VIDTRACK_DATA")
def test_motorway_has_748_frames_at_25_per_second():
    """XviD with packed B-frames: guessed presentation times jump to and fro, and the header counts two too many."""
    frames, source = read(Path(os.environ["VIDTRACK_DATA"]) / "motorway.avi")
    assert source.fps == 25
    assert len(frames) == 748
    assert times(frames) == pytest.approx(np.arange(748) / 25)
