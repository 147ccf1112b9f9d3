"""Pictures that nobody looks at are left out before they are decoded, and this changes nothing else."""

import av
import numpy as np
import pytest
from source_clips import write_clip

from vidtrack.config.settings import SourceSettings
from vidtrack.video.left_out import LeftOut
from vidtrack.video.source import Excerpts, open_part, open_source

H264, MJPEG = ("clip.mp4", "libx264", "yuv420p"), ("clip.avi", "mjpeg", "yuvj420p")
KINDS = [
    H264,
    MJPEG,
    ("clip.mkv", "libx264", "yuv420p"),
    ("clip.mkv", "mjpeg", "yuvj420p"),
    ("clip.mov", "prores_ks", "yuv422p10le"),
    ("clip.mp4", "jpeg2000", "yuv420p"),
]
VARIABLE_MS = np.cumsum([0, *[40, 40, 20, 90, 40, 35, 45, 120, 40, 40] * 6]).tolist()
KEY_EVERY_20 = {"g": "20"}


def shots(path, opened=open_source, **settings):
    """[(number, time, luminance)] of all frames."""
    with opened(str(path), SourceSettings(**settings)) as source:
        return [(frame.index, frame.time_s, frame.y.tobytes()) for frame in source]


@pytest.fixture
def left_out(monkeypatch):
    """The stamps of all packets that are not decoded."""
    found = []
    skips = LeftOut.skips

    def noted(self, packet, stamp):
        skipped = skips(self, packet, stamp)
        found.extend([stamp] * skipped)
        return skipped

    monkeypatch.setattr(LeftOut, "skips", noted)
    return found


def with_all_decoded(monkeypatch, read):
    """What `read` returns when nothing is left out."""
    with monkeypatch.context() as patch:
        patch.setattr(LeftOut, "skips", lambda self, packet, stamp: False)
        return read()


@pytest.mark.parametrize("stamps", [None, VARIABLE_MS], ids=["constant", "variable"])
@pytest.mark.parametrize("most", [2, 4, 6.5, 10, 12.5, 20, 30])
@pytest.mark.parametrize(("name", "codec", "pixels"), KINDS, ids=lambda part: part)
def test_the_frames_are_those_of_a_reading_that_decodes_all(
    tmp_path, monkeypatch, left_out, name, codec, pixels, most, stamps
):
    path = write_clip(tmp_path / name, 60, codec, pixels, stamps_ms=stamps if name != "clip.avi" else None, spare=3)
    for read in (
        lambda: shots(path, max_fps=most),
        lambda: shots(path, open_part, max_fps=most, start_s=1.0),
    ):
        assert read() == with_all_decoded(monkeypatch, read)
    assert bool(left_out) == (most < 30)


@pytest.mark.parametrize("threads", ["1", "4"])
@pytest.mark.parametrize(
    ("name", "coder"),
    [
        ("clip.mp4", {"bf": "5", "x264-params": "b-pyramid=normal:b-adapt=0"}),
        ("clip.ts", {"bf": "3", "x264-params": "open-gop=1:b-adapt=0"}),
        ("clip.ts", {"bf": "2", "x264-params": "slices=3:b-adapt=0"}),
        ("clip.mkv", {"bf": "16", "x264-params": "b-adapt=0"}),
    ],
    ids=["pyramid", "open groups", "slices", "sixteen"],
)
def test_it_knows_the_structures_of_h264(tmp_path, monkeypatch, left_out, name, coder, threads):
    monkeypatch.setenv("VIDTRACK_CORES", threads)
    path = write_clip(tmp_path / name, 100, "libx264", coder=KEY_EVERY_20 | coder)
    for most in (2, 5, 8, 12.5):
        for start_s in (0.0, 1.3, 2.5) if path.suffix != ".ts" else (0.0,):
            left_out.clear()

            def read(most=most, start_s=start_s):
                return shots(path, open_part, max_fps=most, start_s=start_s)

            assert read() == with_all_decoded(monkeypatch, read)
            assert left_out


@pytest.mark.parametrize(("name", "codec", "pixels"), [H264, MJPEG], ids=["h264", "mjpeg"])
def test_excerpts_are_those_of_a_reading_that_decodes_all(tmp_path, monkeypatch, left_out, name, codec, pixels):
    path = write_clip(tmp_path / name, 60, codec, pixels, spare=3)
    excerpts = Excerpts(str(path), SourceSettings(max_fps=10))
    for begin_s, end_s in ((1.0, 2.0), (0.3, 0.7), (1.0, 1.5)):
        left_out.clear()

        def read(begin_s=begin_s, end_s=end_s):
            return [(frame.time_s, frame.y.tobytes()) for frame in excerpts.between(begin_s, end_s)]

        assert read() == with_all_decoded(monkeypatch, read)
        assert left_out
    excerpts.close()


def test_all_are_left_out_to_which_no_other_refers(tmp_path, left_out):
    path = write_clip(tmp_path / "clip.mp4", 200, "libx264", spare=1)
    assert len(shots(path, max_fps=6.25)) == 50
    assert len(left_out) == 78  # of 80; the first come before the time of the first picture is known


@pytest.mark.parametrize(("name", "coder"), [("clip.mp4", {"bf": "0"}), ("clip.avi", {"bf": "2"})])
def test_nothing_is_left_out_without_such_pictures_or_times_of_presentation(tmp_path, left_out, name, coder):
    path = write_clip(tmp_path / name, 50, "libx264", coder=coder)
    assert [number for number, _, _ in shots(path, max_fps=12.5)] == list(range(0, 50, 2))
    assert not left_out


@pytest.mark.parametrize("interlaced", [0, 1])
def test_fields_are_decoded(tmp_path, left_out, interlaced):
    coder = {"x264-params": f"interlaced={interlaced}:bframes=2:b-adapt=0"}
    path = write_clip(tmp_path / "clip.mp4", 50, "libx264", size=(64, 64), coder=coder)
    assert [number for number, _, _ in shots(path, max_fps=12.5)] == list(range(0, 50, 2))
    excerpts = Excerpts(str(path), SourceSettings(max_fps=12.5))
    assert [round(frame.time_s, 3) for frame in excerpts.between(1.0, 1.2)] == [1.04, 1.12, 1.2]
    excerpts.close()
    assert bool(left_out) == (not interlaced)


@pytest.mark.parametrize("parts", [[(0.6, 1.0)], [(0.0, 1.0), (2.2, 1.5)], [(0.3, 0.9), (2.7, 0.7)]])
@pytest.mark.parametrize("spare", [0, 3])
def test_parts_cut_out_of_a_file_count_as_decoded(tmp_path, monkeypatch, parts, spare):
    path = write_clip(tmp_path / "clip.mov", 120, "libx264", spare=spare, coder={"g": "50"})
    cut_out(path, parts)
    for most in (1, 5, 12.5):

        def read(most=most):
            return shots(path, max_fps=most)

        assert read() == with_all_decoded(monkeypatch, read)


def cut_out(path, parts):
    """Write the list of edits: only these parts (begin, length) [s] of the file are shown."""
    data = bytearray(path.read_bytes())
    boxes = [data.rfind(b"moov")]
    for name in (b"trak", b"edts", b"elst"):
        boxes.append(data.index(name, boxes[-1]))
    movie, media = (
        int.from_bytes(data[place + 16 : place + 20], "big")  # ticks a second
        for place in (data.index(b"mvhd", boxes[0]), data.index(b"mdhd", boxes[0]))
    )
    offset = int.from_bytes(data[boxes[-1] + 16 : boxes[-1] + 20], "big")  # stamp of the first picture
    entries = [(round(length * movie), offset + round(begin * media), 0x10000) for begin, length in parts]
    numbers = [0, len(entries), *(number for entry in entries for number in entry)]
    content = b"".join(number.to_bytes(4, "big") for number in numbers)
    end = boxes[-1] + int.from_bytes(data[boxes[-1] - 4 : boxes[-1]], "big") - 4
    grown = len(content) - (end - boxes[-1] - 4)
    for place in boxes:
        size = int.from_bytes(data[place - 4 : place], "big") + grown
        data[place - 4 : place] = size.to_bytes(4, "big")
    data[boxes[-1] + 4 : end] = content
    path.write_bytes(data)


@pytest.mark.parametrize("threads", ["1", "4"])
@pytest.mark.parametrize("codec", ["libx264", "mjpeg"])
@pytest.mark.parametrize("at", [28, 41, 45])
def test_one_stamp_ahead_is_the_only_wrong_one(tmp_path, monkeypatch, codec, at, threads):
    monkeypatch.setenv("VIDTRACK_CORES", threads)
    pixels = "yuvj420p" if codec == "mjpeg" else "yuv420p"
    path = write_clip(tmp_path / "clip.mkv", 0, codec, pixels, stamps_ms=range(0, 4000, 40), ahead={at: 700})
    for most in (1, 5, 12.5):

        def read(most=most):
            return shots(path, max_fps=most)

        assert read() == with_all_decoded(monkeypatch, read)


@pytest.mark.parametrize("spare", [(3, 3), (0, 3), (3, 0)])
def test_joined_files_whose_stamps_begin_anew(tmp_path, monkeypatch, left_out, spare):
    parts = [write_clip(tmp_path / f"{k}.ts", 90, "libx264", spare=many) for k, many in enumerate(spare)]
    path = tmp_path / "joined.ts"
    path.write_bytes(b"".join(part.read_bytes() for part in parts))
    for most in (1, 5, 12.5):

        def read(most=most):
            return shots(path, max_fps=most)

        assert read() == with_all_decoded(monkeypatch, read)
    assert bool(left_out) == (spare[0] > 0)


@pytest.mark.parametrize("looked_at", [False, True])
def test_a_damaged_picture_is_lost_alone(tmp_path, looked_at):
    path = write_clip(tmp_path / "clip.mkv", 40, "mjpeg", "yuvj420p")
    whole = shots(path, max_fps=12.5)
    content = bytearray(path.read_bytes())
    with av.open(str(path)) as container:
        packets = [bytes(packet) for packet in container.demux() if packet.size]
    damaged = range(20 if looked_at else 11, 40, 10)
    for number in damaged:
        place = content.find(packets[number])
        content[place : place + len(packets[number])] = bytes(len(packets[number]))
    path.write_bytes(content)
    with open_source(str(path), SourceSettings(max_fps=12.5)) as source:
        found = [(frame.time_s, frame.y.tobytes()) for frame in source]
        assert source.stats.decode_errors == 2 * looked_at
    assert found == [shot[1:] for shot in whole if shot[0] not in damaged]
