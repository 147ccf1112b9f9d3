"""Pictures that nobody looks at are left out before they are decoded, and this changes nothing else."""

import av
import numpy as np
import pytest
from source_clips import picture, write_clip

from vidtrack.config.settings import SourceSettings
from vidtrack.video.left_out import LeftOut
from vidtrack.video.max_rate import MaxRate
from vidtrack.video.source import Excerpts, open_part, open_source

H264, MJPEG = ("clip.mp4", "libx264", "yuv420p"), ("clip.avi", "mjpeg", "yuvj420p")
KINDS = [H264, MJPEG, ("clip.mkv", "libx264", "yuv420p"), ("clip.mkv", "mjpeg", "yuvj420p")]
VARIABLE_MS = np.cumsum([0, *[40, 40, 20, 90, 40, 35, 45, 120, 40, 40] * 6]).tolist()


def shots(path, opened=open_source, **settings):
    """[(number, time, luminance)] of all frames."""
    with opened(str(path), SourceSettings(**settings)) as source:
        return [(frame.index, frame.time_s, frame.y.tobytes()) for frame in source]


@pytest.fixture
def left_out(monkeypatch):
    """The stamps that were left out, of all files."""
    found = []
    before = LeftOut.before

    def noted(self, stamp):
        for place in before(self, stamp):
            found.append(place)
            yield place

    monkeypatch.setattr(LeftOut, "before", noted)
    return found


@pytest.mark.parametrize("stamps", [None, VARIABLE_MS], ids=["constant", "variable"])
@pytest.mark.parametrize("most", [2, 4, 6.5, 10, 12.5, 20, 30])
@pytest.mark.parametrize(("name", "codec", "pixels"), KINDS, ids=lambda part: part)
def test_the_frames_are_those_of_a_reading_that_decodes_all(
    tmp_path, monkeypatch, left_out, name, codec, pixels, most, stamps
):
    path = write_clip(tmp_path / name, 60, codec, pixels, stamps_ms=stamps if name != "clip.avi" else None, spare=3)
    few, part = shots(path, max_fps=most), shots(path, open_part, max_fps=most, start_s=1.0)
    assert bool(left_out) == (most < 30)
    monkeypatch.setattr(LeftOut, "skips", lambda self, packet, stamp: False)
    assert few == shots(path, max_fps=most)
    assert part == shots(path, open_part, max_fps=most, start_s=1.0)


@pytest.mark.parametrize(("name", "codec", "pixels"), [H264, MJPEG], ids=["h264", "mjpeg"])
def test_excerpts_have_these_frames_too(tmp_path, name, codec, pixels):
    path = write_clip(tmp_path / name, 60, codec, pixels, spare=3)
    whole = [(time_s, luma) for _, time_s, luma in shots(path, max_fps=10)]
    excerpts = Excerpts(str(path), SourceSettings(max_fps=10))
    for begin_s, end_s in ((1.0, 2.0), (0.3, 0.7)):
        found = [(frame.time_s, frame.y.tobytes()) for frame in excerpts.between(begin_s, end_s)]
        assert found == [shot for shot in whole if begin_s <= shot[0] <= end_s]
    excerpts.close()


def test_what_is_left_out_is_most_of_what_no_picture_refers_to(tmp_path, left_out):
    path = write_clip(tmp_path / "clip.mp4", 200, "libx264", spare=1)
    assert len(shots(path, max_fps=6.25)) == 50
    assert len(left_out) > 70  # of 80 to which no other refers


def test_damage_to_pictures_that_nobody_looks_at_does_no_harm(tmp_path):
    path = write_clip(tmp_path / "clip.mkv", 40, "mjpeg", "yuvj420p")
    whole = shots(path, max_fps=12.5)
    content = bytearray(path.read_bytes())
    with av.open(str(path)) as container:
        packets = [bytes(packet) for packet in container.demux() if packet.size]
    for packet in packets[1::2][5:]:
        place = content.find(packet)
        content[place : place + len(packet)] = bytes(len(packet))
    path.write_bytes(content)
    with open_source(str(path), SourceSettings(max_fps=12.5)) as source:
        assert [(frame.index, frame.time_s, frame.y.tobytes()) for frame in source] == whole
        assert source.stats.decode_errors == 0


def test_all_are_decoded_once_a_time_is_not_that_of_its_stamp(tmp_path):
    with av.open(str(write_clip(tmp_path / "clip.mkv", 40, "mjpeg", "yuvj420p"))) as container:
        packets = [(packet, packet.pts) for packet in container.demux() if packet.size]
        rate = MaxRate(12.5, 25, since_s=0.0)
        left_out = LeftOut(container.streams.video[0].codec_context, rate, 1000, in_order=True)
        assert not any(left_out.skips(*packet) for packet in packets[:10])  # the time of no stamp is known
        left_out.take(0, 0.0, None)
        assert [left_out.skips(*packet) for packet in packets[10:20]] == [False, True] * 5
        left_out.take(400, 441.0, None)
        assert not any(left_out.skips(*packet) for packet in packets[20:])


def test_fields_are_decoded(tmp_path, left_out):
    path = tmp_path / "clip.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=25)
        stream.width, stream.height, stream.pix_fmt = 64, 64, "yuv420p"
        stream.options = {"x264-params": "interlaced=1:bframes=2"}
        for number in range(50):
            frame = av.VideoFrame.from_ndarray(picture(number, (64, 64)), format="bgr24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    assert [number for number, _, _ in shots(path, max_fps=12.5)] == list(range(0, 50, 2))
    assert not left_out
