"""What cannot be read is refused in one clear line; what can be read in part is."""

from __future__ import annotations

import os
import random
import wave

import av
import numpy as np
import pytest
from source_clips import picture, write_clip

from vidtrack.config.settings import SourceSettings
from vidtrack.errors import SourceError
from vidtrack.video.source import open_source


def refused(path) -> str:
    with pytest.raises(SourceError) as error:
        open_source(str(path), SourceSettings())
    assert error.value.exit_code == 3
    assert "\n" not in str(error.value)
    return str(error.value)


def read(path):
    with open_source(str(path), SourceSettings()) as source:
        return list(source), source.stats


def test_missing_file_names_the_nearest(tmp_path):
    (tmp_path / "traffic.avi").touch()
    assert "traffic.avi?" in refused(tmp_path / "trafic.avi")


def test_missing_folder_is_named(tmp_path):
    assert f"no folder {tmp_path / 'nowhere'}" in refused(tmp_path / "nowhere" / "traffic.avi")


@pytest.mark.parametrize("name", ["text.avi", "text.txt", "text.mp4"])
def test_text(tmp_path, name):
    path = tmp_path / name
    path.write_text("this is no video\n" * 100)
    assert name in refused(path)


def test_noise(tmp_path):
    path = tmp_path / "noise.avi"
    path.write_bytes(random.Random(1).randbytes(20_000))
    refused(path)


def test_zero_bytes(tmp_path):
    path = tmp_path / "empty.avi"
    path.touch()
    assert "0 bytes" in refused(path)


def test_audio_only(tmp_path):
    path = tmp_path / "sound.avi"
    with av.open(str(path), "w", format="avi") as container:
        stream = container.add_stream("pcm_s16le", rate=8000, layout="mono")
        sound = av.AudioFrame.from_ndarray(np.zeros((1, 8000), np.int16), format="s16", layout="mono")
        sound.sample_rate = 8000
        container.mux(stream.encode(sound))
        container.mux(stream.encode())
    assert "only audio" in refused(path)


def test_cover_of_an_audio_file_is_no_video(tmp_path):
    path = tmp_path / "song.mp4"
    with av.open(str(path), "w") as container:
        cover = container.add_stream("mjpeg")
        cover.width, cover.height, cover.pix_fmt = 64, 48, "yuvj420p"
        cover.disposition = av.stream.Disposition.attached_pic
        stream = container.add_stream("aac", rate=8000, layout="mono")
        sound = av.AudioFrame.from_ndarray(np.zeros((1, 8000), np.float32), format="fltp", layout="mono")
        sound.sample_rate = 8000
        image = av.VideoFrame.from_ndarray(picture(0), format="bgr24").reformat(format="yuvj420p")
        for packets in (cover.encode(image), cover.encode(), stream.encode(sound), stream.encode()):
            container.mux(packets)
    assert "only audio" in refused(path)


def test_wave_file_named_avi(tmp_path):
    path = tmp_path / "sound.avi"
    with wave.open(str(path), "wb") as sound:
        sound.setparams((1, 2, 8000, 0, "NONE", ""))
        sound.writeframes(bytes(16_000))
    assert "only audio" in refused(path)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read everything")
def test_permission_denied(tmp_path):
    path = write_clip(tmp_path / "clip.avi", 3)
    path.chmod(0)
    assert "Permission denied" in refused(path)


def test_pipe_is_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "pipe.avi")
    assert "neither a file nor a folder" in refused(tmp_path / "pipe.avi")


def test_stream_address_is_not_repeated():
    message = refused("rtsp://user:secret@camera/1")
    assert "vidtrack live" in message
    assert "secret" not in message


def test_video_without_a_decodable_picture(tmp_path):
    path = write_clip(tmp_path / "clip.avi", 5, "mjpeg", "yuvj420p")
    data = bytearray(path.read_bytes())
    start = data.index(b"movi")
    data[start + 4 + 8 : data.index(b"idx1")] = bytes(data.index(b"idx1") - start - 12)
    path.write_bytes(data)
    refused(path)


@pytest.mark.parametrize("codec", ["mpeg4", "mjpeg", "rawvideo"])
@pytest.mark.parametrize("kept", [0.5, 0.8])
def test_avi_cut_in_the_middle(tmp_path, codec, kept):
    """What is cut off takes the index with it."""
    pixels = {"mpeg4": "yuv420p", "mjpeg": "yuvj420p", "rawvideo": "bgr24"}[codec]
    path = write_clip(tmp_path / "clip.avi", 40, codec, pixels, (320, 240))
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * kept)])
    frames, stats = read(path)
    assert 40 * kept - 12 < len(frames) < 40
    assert stats.truncated
    assert "cut short" in stats.warnings[0]
    np.testing.assert_allclose([frame.time_s for frame in frames], np.arange(len(frames)) / 25, atol=1e-9)


def test_avi_without_index_is_whole(tmp_path):
    path = write_clip(tmp_path / "clip.avi", 20)
    data = bytearray(path.read_bytes()[: path.read_bytes().index(b"idx1")])
    data[4:8] = (len(data) - 8).to_bytes(4, "little")
    path.write_bytes(data)
    frames, stats = read(path)
    assert len(frames) == 20
    assert not stats.truncated


def test_recording_that_was_never_closed_is_read(tmp_path):
    """A recorder that lost power leaves the sizes of the container at zero."""
    path = write_clip(tmp_path / "clip.avi", 20, "mjpeg", "yuvj420p")
    data = bytearray(path.read_bytes()[: path.read_bytes().index(b"idx1")])
    data[4:8] = bytes(4)
    path.write_bytes(data)
    assert len(read(path)[0]) == 20


@pytest.mark.parametrize(("name", "options"), [("clip.mp4", {"movflags": "faststart"}), ("clip.mkv", {})])
def test_cut_mp4_and_mkv(tmp_path, name, options):
    options = options | {"cluster_size_limit": "4000"} if name.endswith("mkv") else options
    path = write_clip(tmp_path / name, 60, "libx264", options=options)
    data = path.read_bytes()
    path.write_bytes(data[: int(len(data) * 0.7)])
    frames, stats = read(path)
    assert 10 < len(frames) < 60
    assert stats.truncated


def test_mp4_cut_before_its_index_is_refused_with_the_reason(tmp_path):
    path = write_clip(tmp_path / "clip.mp4", 30, "libx264")
    data = path.read_bytes()
    path.write_bytes(data[: len(data) // 2])
    assert "cut short" in refused(path)


def test_undecodable_end_is_truncated(tmp_path):
    path = write_clip(tmp_path / "clip.avi", 20, "mjpeg", "yuvj420p")
    blank(path, 19)
    frames, stats = read(path)
    assert len(frames) == 19
    assert stats.truncated


def test_corrupt_picture_in_the_middle_costs_one_picture_and_no_time(tmp_path):
    path = write_clip(tmp_path / "clip.avi", 20, "mjpeg", "yuvj420p")
    blank(path, 9)
    frames, stats = read(path)
    assert stats.decode_errors == 1
    assert not stats.truncated
    assert [round(frame.time_s * 25) for frame in frames] == [i for i in range(20) if i != 9]
    assert len(stats.warnings) == 1


def blank(path, picture):
    """Overwrite one JPEG of a motion JPEG file with zeros."""
    data = bytearray(path.read_bytes())
    start = -1
    for _ in range(picture + 1):
        start = data.index(b"\xff\xd8\xff", start + 1)
    end = data.index(b"\xff\xd9", start) + 2
    data[start:end] = bytes(end - start)
    path.write_bytes(data)


@pytest.mark.parametrize("codec", ["mpeg4", "libx264", "mjpeg"])
@pytest.mark.parametrize("seed", range(4))
def test_random_damage_is_counted_and_reading_goes_on(tmp_path, codec, seed):
    path = write_clip(tmp_path / "clip.avi", 60, codec, "yuvj420p" if codec == "mjpeg" else "yuv420p", (160, 120))
    data = bytearray(path.read_bytes())
    random_ = random.Random(seed)
    for _ in range(40):
        data[random_.randrange(len(data) * 3 // 10, len(data) * 7 // 10)] = random_.randrange(256)
    path.write_bytes(data)
    frames, stats = read(path)
    assert len(frames) > 40
    assert (np.diff([frame.time_s for frame in frames]) > 0).all()
    assert bool(stats.decode_errors) == bool(stats.warnings)
