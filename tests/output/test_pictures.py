"""Annotated video, trajectory picture, masks, decisions."""

import csv
import sys

import av
import cv2
import numpy as np
import pytest
from synthetic_steps import make_step

from vidtrack.config.settings import OutputSettings
from vidtrack.decision import Choices, Event
from vidtrack.errors import ConfigError, OutputError, StoppedEarly
from vidtrack.output.decisions import HEADER, DecisionLog
from vidtrack.output.masks import MaskFolder
from vidtrack.output.plot import TrajectoryPlot
from vidtrack.output.threaded import Threaded
from vidtrack.output.trails import Trails
from vidtrack.output.video import AnnotatedVideo
from vidtrack.traffic.lines import parse_line

ALL_STATES = [(1, "t", 20, 20), (2, "c", 60, 30), (3, "o", 90, 50), (4, "m", 30, 70), (5, "m", 40, 72)]


def film(path, times, shape=(90, 121)):
    sink = Threaded(AnnotatedVideo(path, 25.0, OutputSettings(), [parse_line("gate:60,0,60,89")]))
    for index, t in enumerate(times):
        sink.step(make_step(index, ALL_STATES, shape=shape, time_s=t))
    sink.close()


def decoded(path):
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        return [(float(frame.pts * stream.time_base), frame) for frame in container.decode(stream)]


def test_the_video_plays_in_a_browser_and_keeps_the_times_of_the_source(tmp_path):
    times = [0.0, 0.04, 0.08, 0.5, 0.54, 2.0]
    film(tmp_path / "a.mp4", times)
    frames = decoded(tmp_path / "a.mp4")
    assert [t for t, _ in frames] == pytest.approx(times, abs=1e-4)
    with av.open(str(tmp_path / "a.mp4")) as container:
        codec = container.streams.video[0].codec_context
        assert (codec.name, codec.pix_fmt) == ("h264", "yuv420p")
        assert (codec.width, codec.height) == (122, 90)  # 4:2:0 needs even sides


def test_equal_times_do_not_stop_the_encoder(tmp_path):
    film(tmp_path / "a.mp4", [0.0, 0.0, 0.04])
    assert len(decoded(tmp_path / "a.mp4")) == 3


def test_a_run_without_a_frame_leaves_no_video_that_nothing_plays(tmp_path):
    film(tmp_path / "a.mp4", [])
    assert not (tmp_path / "a.mp4").exists()


def test_a_video_that_was_never_closed_can_be_read(tmp_path):
    sink = AnnotatedVideo(tmp_path / "a.mp4", 25.0, OutputSettings())
    for index in range(200):
        sink.step(make_step(index, ALL_STATES, shape=(90, 120)))
    left = tmp_path / "left.mp4"
    left.write_bytes((tmp_path / "a.mp4").read_bytes())  # what a kill would leave
    sink.close()
    assert decoded(left)[-1][0] > 200 / 25.0 - 5.0


def test_boxes_are_drawn_where_the_tracks_are(tmp_path):
    sink = AnnotatedVideo(tmp_path / "a.mp4", 25.0, OutputSettings(video_crf=5))
    for index in range(3):
        sink.step(make_step(index, [(2, "c", 60, 40)], shape=(90, 120)))
    sink.close()
    picture = decoded(tmp_path / "a.mp4")[-1][1].to_ndarray(format="bgr24").astype(int)
    colourful = np.ptp(picture, axis=2) > 60
    assert colourful[45, 50:70].mean() > 0.8  # bottom edge
    assert not colourful[60:, :].any()


def test_a_video_that_cannot_be_written_is_refused_before_the_run(tmp_path):
    with pytest.raises(OutputError, match="missing"):
        AnnotatedVideo(tmp_path / "missing" / "a.mp4", 25.0, OutputSettings())


def test_a_video_of_stored_detections_is_refused(tmp_path):
    sink = AnnotatedVideo(tmp_path / "a.mp4", 25.0, OutputSettings())
    with pytest.raises(ConfigError, match="--video"):
        sink.step(make_step(0, ALL_STATES))
    sink.close()


@pytest.mark.skipif(sys.platform != "linux", reason="needs /dev/full")
def test_a_full_disk_stops_the_video(tmp_path):
    (tmp_path / "a.mp4").symlink_to("/dev/full")
    sink = AnnotatedVideo(tmp_path / "a.mp4", 25.0, OutputSettings())
    with pytest.raises(StoppedEarly, match="No space left"):  # noqa: PT012
        for index in range(300):
            sink.step(make_step(index, ALL_STATES, shape=(90, 120)))
    with pytest.raises(StoppedEarly, match="No space left"):
        sink.close()


class Fails:
    """Sink that fails at step 3."""

    def __init__(self):
        self.taken = []
        self.closed = False

    def step(self, step):
        if step.index == 3:
            raise StoppedEarly("full")
        self.taken.append(step.index)

    def close(self):
        self.closed = True


def test_what_fails_in_the_thread_reaches_the_pipeline():
    inner = Fails()
    sink = Threaded(inner, depth=2)
    with pytest.raises(StoppedEarly, match="full"):  # noqa: PT012
        for index in range(10):
            sink.step(make_step(index, []))
    sink.close()
    assert inner.taken[:3] == [0, 1, 2]
    assert inner.closed


def test_what_fails_in_the_last_step_is_raised_on_closing():
    inner = Fails()
    sink = Threaded(inner)
    sink.step(make_step(3, []))
    with pytest.raises(StoppedEarly, match="full"):
        sink.close()
    assert inner.closed


def plot(path, frames, shape, **options):
    sink = TrajectoryPlot(path, shape, **options)
    for index, rows in enumerate(frames):
        sink.step(make_step(index, rows))
    sink.close()
    return cv2.imread(str(path)).astype(int)


def test_small_pictures_are_enlarged_and_large_ones_are_not(tmp_path):
    assert plot(tmp_path / "a.png", [], (180, 240)).shape == (720, 960, 3)
    assert plot(tmp_path / "b.png", [], (1080, 1920)).shape == (1080, 1920, 3)


def test_trajectories_are_drawn_over_the_scene(tmp_path):
    frames = [[(1, "c", x, 90)] for x in range(20, 200, 4)]
    scene = np.full((180, 240, 3), 128, np.uint8)
    picture = plot(tmp_path / "a.png", frames, (180, 240), scene=lambda: scene, lines=[parse_line("gate:0,20,239,20")])
    coloured = np.ptp(picture, axis=2) > 100
    assert coloured[360, 90:760].all()  # the way, four times enlarged
    assert coloured[80, 10:400].all()  # the line
    assert (picture[600:, :] == 128).all()


def test_the_plot_tells_the_counts_and_no_number_covers_them(tmp_path):
    rows = [[(1, "c", 2, 98)]]
    options = {"lines": [parse_line("gate:0,100,239,100")], "totals": lambda: {"gate": {"down": 0, "up": 12}}}
    plain = plot(tmp_path / "a.png", [], (180, 240), **options)
    numbered = plot(tmp_path / "b.png", rows, (180, 240), **options)
    label = (slice(388, 398), slice(0, 60))
    assert (plain[label] == numbered[label]).all()
    assert (plain != numbered).any()
    assert (plot(tmp_path / "c.png", [], (180, 240), lines=options["lines"])[label] != plain[label]).any()


def test_the_plot_bridges_a_gap_but_does_not_follow_a_lost_track(tmp_path):
    gap = dict(zip(range(20, 220, 10), "cccccccoooooocccccccc", strict=False))
    frames = [[(1, letter, x, 40), (2, "c" if x < 100 else "o", x, 120)] for x, letter in gap.items()]
    picture = plot(tmp_path / "a.png", frames, (180, 240))
    coloured = np.ptp(picture, axis=2) > 100
    assert coloured[160, 90:800].all()
    assert not coloured[480, 460:].any()


def test_masks_are_named_by_frame_and_hold_0_and_255_at_source_size(tmp_path):
    sink = MaskFolder(tmp_path / "masks")
    for index in range(2):
        sink.step(make_step(index, ALL_STATES, shape=(91, 121)))
    sink.close()
    assert sorted(p.name for p in (tmp_path / "masks").iterdir()) == ["000000.png", "000001.png"]
    mask = cv2.imread(str(tmp_path / "masks" / "000001.png"), cv2.IMREAD_UNCHANGED)
    assert mask.shape == (91, 121)
    assert set(np.unique(mask)) == {0, 255}
    assert mask[30, 60] == 255


def test_masks_that_cannot_be_written_are_refused(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="file"):
        MaskFolder(tmp_path / "file")
    with pytest.raises(ConfigError, match="--save-masks"):
        MaskFolder(tmp_path / "masks").step(make_step(0, []))


def test_decisions_tell_choice_runner_up_and_reason(tmp_path):
    choices = Choices(
        track_id=np.array([1, 2]),
        measurement=np.array([4, -1]),
        weight=np.array([1.0, np.nan]),
        d2=np.array([0.51234567, np.nan]),
        gate=np.array([9.21, 9.21]),
        runner_up=np.array([7, -1]),
        runner_up_d2=np.array([3.25, np.nan]),
        candidates=np.array([[4, 7], [-1, -1]]),
        candidates_weight=np.array([[0.75, 0.125], [np.nan, np.nan]]),
        candidates_d2=np.array([[0.51234567, 3.25], [np.nan, np.nan]]),
    )
    events = (Event(0.04, 2, "delete", 'left the picture, "exit"'),)
    sink = DecisionLog(tmp_path / "decisions.csv")
    sink.step(make_step(0, []))
    sink.step(make_step(1, [(1, "c", 5, 5)], choices=choices, events=events))
    sink.close()
    with open(tmp_path / "decisions.csv", newline="") as file:
        rows = list(csv.reader(file))
    assert rows == [
        ["frame", *HEADER.strip().split(",")],
        ["1", "0.040000", "1", "update", "4", "1", "0.5123", "9.21", "7", "3.25", "4:0.75:0.5123;7:0.125:3.25", ""],
        ["1", "0.040000", "2", "miss", "", "", "", "9.21", "", "", "", ""],
        ["1", "0.040000", "2", "delete", "", "", "", "", "", "", "", "left the picture, 'exit'"],
    ]


def test_trails_reach_back_a_given_time_and_end_with_the_track():
    trails = Trails(0.1)
    for index in range(10):
        rows = [(9, "c", index, 0), (4, "t", 0, 0)] + ([(2, "c", 0, index)] if index < 9 else [])
        trails.step(make_step(index, rows, fps=25.0).tracks)
    assert {track: path.tolist() for track, path in trails.paths().items()} == {9: [[7, 0], [8, 0], [9, 0]]}
