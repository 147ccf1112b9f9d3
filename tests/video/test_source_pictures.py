"""Image folders and globs: natural order, a rate from somewhere, and what is broken is left out."""

from __future__ import annotations

import cv2
import numpy as np
import pytest
from source_clips import level, picture

from vidtrack.config.settings import SourceSettings
from vidtrack.errors import FormatError, SourceError
from vidtrack.video.source import open_source


def write_images(folder, names, size=(64, 48), grey=False):
    folder.mkdir(parents=True, exist_ok=True)
    for index, name in enumerate(names):
        image = picture(index, size)
        cv2.imwrite(str(folder / name), image[..., 0] if grey else image)
    return folder


def read(path, **settings):
    with open_source(str(path), SourceSettings(**settings)) as source:
        return list(source), source


def levels(frames):
    return [float(frame.y.mean()) for frame in frames]


@pytest.mark.parametrize("suffix", ["jpg", "JPG", "png", "bmp", "tif", "webp"])
def test_natural_order_in_every_format(tmp_path, suffix):
    names = [f"img{i}.{suffix}" for i in (1, 2, 3, 9, 10, 11, 100)]
    frames, source = read(write_images(tmp_path / "seq", names), fps=10)
    np.testing.assert_allclose(levels(frames), [level(i) for i in range(7)], atol=2)
    assert [frame.index for frame in frames] == list(range(7))
    assert [frame.time_s for frame in frames] == pytest.approx(np.arange(7) / 10)
    assert (source.name, source.frames, source.fps) == ("seq", 7, 10)
    assert all(frame.full_range for frame in frames)


def test_glob_takes_what_it_matches(tmp_path):
    write_images(tmp_path, ["a1.png", "a2.png", "a10.png"])
    write_images(tmp_path, ["b1.png"])
    frames, _ = read(tmp_path / "a*.png", fps=25)
    np.testing.assert_allclose(levels(frames), [level(i) for i in range(3)], atol=2)


def test_folder_with_brackets_in_its_name_is_no_pattern(tmp_path):
    assert len(read(write_images(tmp_path / "run[1]", ["1.png", "2.png"]), fps=25)[0]) == 2


def test_colour_survives(tmp_path):
    (tmp_path / "seq").mkdir()
    red = np.full((48, 64, 3), (10, 20, 200), np.uint8)
    cv2.imwrite(str(tmp_path / "seq" / "1.png"), red)
    frames, _ = read(tmp_path / "seq", fps=25)
    np.testing.assert_allclose(frames[0].bgr()[20, 20], red[20, 20], atol=3)


@pytest.mark.parametrize("bits", [8, 16])
def test_grey_images_have_no_chroma(tmp_path, bits):
    (tmp_path / "seq").mkdir()
    cv2.imwrite(str(tmp_path / "seq" / "1.png"), np.full((9, 7), 100 << (bits - 8), f"uint{bits}"))
    frames, _ = read(tmp_path / "seq", fps=25)
    assert frames[0].u is None
    np.testing.assert_allclose(frames[0].y, 100, atol=1)


@pytest.mark.parametrize("above", [False, True])
def test_rate_from_seqinfo(tmp_path, above, caplog):
    folder = write_images(tmp_path / "seq" / "img1", ["1.png", "2.png"])
    place = folder.parent if above else folder
    (place / "seqinfo.ini").write_text("[Sequence]\nname=crossroads\nframeRate=14\nseqLength=2\n")
    frames, source = read(folder)
    assert frames[1].time_s == pytest.approx(1 / 14)
    assert source.name == "crossroads"
    assert source.stats.warnings == []
    assert read(folder, fps=7)[0][1].time_s == pytest.approx(1 / 7)


def test_rate_is_assumed_with_a_warning(tmp_path, caplog):
    frames, source = read(write_images(tmp_path / "seq", ["1.png", "2.png"]))
    assert frames[1].time_s == pytest.approx(1 / 25)
    assert "--fps" in source.stats.warnings[0]
    assert "--fps" in caplog.text


def test_wrong_seqinfo_is_an_error(tmp_path):
    folder = write_images(tmp_path / "seq", ["1.png"])
    (folder / "seqinfo.ini").write_text("[Sequence]\nframeRate=fast\n")
    with pytest.raises(FormatError, match="frameRate = 'fast'"):
        open_source(str(folder), SourceSettings())


def test_data_set_folder_leads_to_its_images(tmp_path):
    write_images(tmp_path / "highway" / "input", ["in1.jpg", "in2.jpg"])
    write_images(tmp_path / "highway", ["ROI.bmp"])
    frames, source = read(tmp_path / "highway", fps=25)
    assert (len(frames), source.name) == (2, "highway")


def test_other_sizes_and_kinds_follow_the_first(tmp_path):
    write_images(tmp_path / "seq", ["1.png"], (64, 48))
    write_images(tmp_path / "seq", ["2.png", "3.png"], (90, 31))
    write_images(tmp_path / "seq", ["4.png"], (64, 48), grey=True)
    frames, source = read(tmp_path / "seq", fps=25)
    assert [frame.shape for frame in frames] == [(48, 64)] * 4
    assert [frame.u.shape for frame in frames] == [(24, 32)] * 4
    assert len(source.stats.warnings) == 1
    assert "90x31" in source.stats.warnings[0]


def test_unreadable_images_are_counted_and_the_others_keep_their_times(tmp_path):
    folder = write_images(tmp_path / "seq", [f"{i}.png" for i in range(6)])
    (folder / "0.png").write_bytes(b"")
    (folder / "2.png").write_text("no image")
    whole = (folder / "3.png").read_bytes()
    (folder / "3.png").write_bytes(whole[:20])
    frames, source = read(folder, fps=10)
    assert [frame.index for frame in frames] == [1, 4, 5]
    assert [frame.time_s for frame in frames] == pytest.approx([0.1, 0.4, 0.5])
    assert source.stats.decode_errors == 3
    assert "0.png" in source.stats.warnings[0]


@pytest.mark.parametrize("files", [[], ["notes.txt", ".hidden.png"]])
def test_folder_without_images(tmp_path, files):
    for name in files:
        (tmp_path / name).touch()
    with pytest.raises(SourceError, match="no images in folder"):
        open_source(str(tmp_path), SourceSettings())


def test_folder_of_unreadable_images(tmp_path):
    (tmp_path / "1.png").write_text("no image")
    with pytest.raises(SourceError, match="can be decoded"):
        open_source(str(tmp_path), SourceSettings(fps=25))


def test_pattern_that_matches_no_image(tmp_path):
    (tmp_path / "a.txt").touch()
    with pytest.raises(SourceError, match=r"a\.txt"):
        open_source(str(tmp_path / "*.txt"), SourceSettings())
    with pytest.raises(SourceError, match="nothing"):
        open_source(str(tmp_path / "*.png"), SourceSettings())
