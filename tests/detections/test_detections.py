"""MOT detections as scans."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest

from vidtrack.config.load import load
from vidtrack.config.settings import Settings, SourceSettings, TrackerSettings
from vidtrack.detections.stored import is_detections, open_detections
from vidtrack.errors import ConfigError, FormatError, SourceError
from vidtrack.formats import read
from vidtrack.run.files import run_file
from vidtrack.video.source import open_source

LINES = """\
1,-1,10,20,40,100,0.9,-1,-1,-1
3,-1,50,60,4,6,-0.5,-1,-1,-1
3,-1,70,80,20,20,0.2,-1,-1,-1
"""


def opened(path, **detections):
    """The detections of a file at 10 frames/s."""
    return open_detections(str(path), Settings(source=SourceSettings(fps=10), detections=detections))


@pytest.fixture
def det(tmp_path):
    (tmp_path / "det.txt").write_text(LINES)
    return tmp_path / "det.txt"


def test_boxes_become_centres_with_a_spread_that_grows_with_the_box(det):
    scans = list(opened(det))
    assert [(index, time_s, len(scan)) for index, time_s, scan in scans] == [
        (0, 0.0, 1),
        (1, pytest.approx(0.1), 0),
        (2, pytest.approx(0.2), 2),
    ]
    scan = scans[0][2]
    np.testing.assert_allclose(scan.z, [[30, 70]])
    np.testing.assert_allclose(scan.box, [[-20, -50, 40, 100]])
    np.testing.assert_allclose(scan.R, [np.eye(2) * 5.0**2])
    np.testing.assert_allclose(scans[2][2].R[0], np.eye(2) * 0.5**2)
    assert all(scan.t == time_s for _, time_s, scan in scans)


def test_settings_win_over_what_the_file_tells(det):
    told = opened(det, sure_score=0.3, jitter=0.2).settings
    assert (told.sure_score, told.jitter, told.accel) == (0.3, 0.2, None)
    np.testing.assert_allclose(next(iter(opened(det, jitter=0.2)))[2].R, [np.eye(2) * 20.0**2])


def test_scores_count_by_their_order_only(tmp_path):
    def scores(values):
        path = tmp_path / "det.txt"
        path.write_text("".join(f"1,-1,{20 * i},0,9,9,{value}\n" for i, value in enumerate(values)))
        return next(iter(opened(path)))[2].score

    np.testing.assert_allclose(scores([0.1, 0.9, 0.4, 0.4]), [0.25, 1, 0.75, 0.75])
    np.testing.assert_allclose(scores([-1, 140, 30, 30]), [0.25, 1, 0.75, 0.75])
    assert scores([1, 1]) is None, "no score tells one from the other"
    assert scores([0.3]) is None


@pytest.mark.parametrize("method", ["sn", "psn"])
def test_methods_by_strength_need_scores_that_differ(det, method):
    by_strength = Settings(tracker=TrackerSettings(method=method))
    assert len(list(open_detections(str(det), by_strength))) == 3
    det.write_text("1,-1,10,20,40,100\n2,-1,12,20,40,100\n")
    with pytest.raises(ConfigError, match=f"no scores.* {method} chooses"):
        open_detections(str(det), by_strength)


def test_of_two_boxes_of_one_object_the_better_one_stays(det):
    """Another box of the same object goes; that of a neighbour, who is half hidden, stays."""
    det.write_text(
        "1,-1,100,100,40,100,0.6\n1,-1,103,102,40,98,0.9\n1,-1,120,100,40,100,0.5\n2,-1,100,100,40,100,0.1\n"
    )
    boxes = [scan.z - 0.5 * scan.box[:, 2:] for _, _, scan in opened(det)]
    np.testing.assert_allclose(boxes[0], [[103, 102], [120, 100]])
    np.testing.assert_allclose(boxes[1], [[100, 100]])


def test_seqinfo_gives_rate_size_and_length(det):
    (det.parent / "seqinfo.ini").write_text(
        "[Sequence]\nname=street\nframeRate=20\nseqLength=6\nimWidth=640\nimHeight=480\n"
    )
    detections = open_detections(str(det), Settings())
    assert (detections.name, detections.fps, detections.width, detections.height) == ("street", 20, 640, 480)
    assert [len(scan) for _, _, scan in detections] == [1, 0, 2, 0, 0, 0]
    assert detections.stats.frames_read == detections.frames == 6


def test_without_seqinfo_the_size_holds_all_boxes_and_the_rate_is_assumed(det):
    detections = open_detections(str(det), Settings())
    assert (detections.width, detections.height, detections.fps) == (90, 120, 25)
    assert "--fps" in detections.stats.warnings[0]


def test_lines_in_any_order(det):
    det.write_text("".join(reversed(LINES.splitlines(keepends=True))))
    assert [len(scan) for _, _, scan in opened(det)] == [1, 0, 2]


def test_start_and_end(det):
    def indices(**span):
        settings = Settings(source=SourceSettings(fps=10, **span))
        return [index for index, _, _ in open_detections(str(det), settings)]

    assert indices(start_s=0.1, end_s=0.2) == [1, 2]
    with pytest.raises(SourceError, match=r"between 9 s and its end; the last one is at 0\.\d s"):
        indices(start_s=9)


@pytest.mark.parametrize(
    "line", ["2,-1,a,5,6,7,1", "2,-1,5,6", "0,-1,1,1,5,5,1", "2,-1,nan,1,5,5,1", "2,-1,1,1,-5,5,1", "1e10,-1,1,1,5,5,1"]
)
def test_malformed_line_is_named(det, line):
    det.write_text(LINES + line + "\n")
    with pytest.raises(FormatError, match="line 4"):
        open_detections(str(det), Settings())


def test_told_from_other_text_by_content(tmp_path, det):
    assert is_detections(str(det))
    for name, text, expected in [
        ("broken_start.txt", "1,-1,a,2,3,4\n" + LINES, True),
        ("no_confidence.csv", "1,-1,10,20,30,40\n", True),
        ("prose.txt", "six numbers: 1 2 3 4 5 6\n", False),
        ("few.txt", "1,2,3,4,5\n", False),
        ("empty.txt", "", False),
        ("traffic.avi", LINES, False),
    ]:
        (tmp_path / name).write_text(text)
        assert is_detections(str(tmp_path / name)) is expected, name
    assert not is_detections(str(tmp_path))
    assert not is_detections(str(tmp_path / "missing.txt"))
    with pytest.raises(SourceError):
        open_source(str(tmp_path / "traffic.avi"), SourceSettings())


def traffic(path, score=lambda s: s):
    """A det.txt of three vehicles, one unseen for a while, each box with errors, and of strays with low scores."""
    rng = np.random.default_rng(4)
    lines = []
    for k in range(80):
        for n, (x, y, v) in enumerate([(40, 60, 4.0), (500, 160, -5.0), (60, 260, 3.0)]):
            if (n == 2 and 30 <= k < 38) or rng.random() < 0.1:
                continue
            left, top = np.array([x + v * k, y]) + rng.normal(size=2)
            lines.append((k, left, top, 40, 20, rng.uniform(0.5, 0.9)))
        lines += [(k, *rng.uniform(0, 400, 2), 40, 20, rng.uniform(0.1, 0.5)) for _ in range(2)]
    path.write_text("".join(f"{k + 1},-1,{x},{y},{w},{h},{score(s)}\n" for k, x, y, w, h, s in lines))
    return path


def result(path, output, *assignments):
    """(N, 6) frame, id and box of the tracks of a det.txt, by the table that a run writes."""
    with run_file(str(path), load(assignments=assignments), output) as run:
        for _ in run:
            pass
    table = read(output)
    return np.column_stack([table.frame, table.id, table.box])


def test_any_rate_that_is_assumed_gives_the_same_tracks(tmp_path, monkeypatch):
    """Only times and speeds follow it; of what is stated instead a tracker believes that it is true."""
    found = {}
    for fps in (5.0, 25.0, 100.0):
        monkeypatch.setattr("vidtrack.video.sequence.FALLBACK_FPS", fps)
        found[fps] = result(traffic(tmp_path / "det.txt"), tmp_path / f"{fps:g}")
    assert len(np.unique(found[25.0][:, 1])) == 3
    for fps in (5.0, 100.0):
        np.testing.assert_allclose(found[fps], found[25.0], atol=0.02)


def test_any_scale_of_scores_gives_the_same_tracks(tmp_path):
    first = result(traffic(tmp_path / "det.txt"), tmp_path / "a", "source.fps=10")
    for n, scale in enumerate((lambda s: 1e-3 * s**3, lambda s: 100 * s - 140)):
        other = result(traffic(tmp_path / "det.txt", scale), tmp_path / f"b{n}", "source.fps=10")
        np.testing.assert_array_equal(first, other)


def test_broken_tracks_of_detections_are_linked_unless_told_otherwise(tmp_path):
    path = traffic(tmp_path / "det.txt")
    short = ("source.fps=10", "tracker.coast_s=0.3")
    assert len(np.unique(result(path, tmp_path / "a", *short)[:, 1])) == 3
    assert len(np.unique(result(path, tmp_path / "b", *short, "output.link=false")[:, 1])) > 3
    assert len(np.unique(result(path, tmp_path / "c", *short, "output.link_s=0.4")[:, 1])) > 3


def test_tracks_of_detections_are_smoothed_unless_told_otherwise(tmp_path):
    path, rough = traffic(tmp_path / "det.txt"), {}
    for name, smooth in (("by default", ()), ("asked for", ("true",)), ("refused", ("false",))):
        assignments = ["source.fps=10", *(f"output.smooth={value}" for value in smooth)]
        found = result(path, tmp_path / name, *assignments)
        left = [found[found[:, 1] == track, 2] for track in np.unique(found[:, 1])]
        rough[name] = np.mean([np.abs(np.diff(side, 2)).mean() for side in left])
    assert rough["by default"] == rough["asked for"] < 0.5 * rough["refused"]


@pytest.mark.skipif("VIDTRACK_DATA" not in os.environ, reason="needs the real data: set VIDTRACK_DATA")
def test_mot15_sequence():
    path = Path(os.environ["VIDTRACK_DATA"]) / "mot15" / "ADL-Rundle-6" / "det" / "det.txt"
    detections = open_detections(str(path), Settings())
    scans = [scan for _, _, scan in detections]
    assert (detections.fps, detections.width, detections.height, len(scans)) == (30, 1920, 1080, 525)
    assert sum(map(len, scans)) == sum(1 for _ in path.open())
