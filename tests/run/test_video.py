"""From a video to tracks, by the Python API."""

from itertools import islice, pairwise

import numpy as np
import pytest
from command_line import SAMPLES

from vidtrack import formats, score
from vidtrack.config.load import load
from vidtrack.config.settings import Settings, SourceSettings, TrackerSettings
from vidtrack.errors import ConfigError, SourceError
from vidtrack.run.files import run_file
from vidtrack.run.run import Extras
from vidtrack.run.trackers import box_tracker, build_blob_tracker, build_box_tracker
from vidtrack.run.video import build_detector, has_driven, track, video_steps
from vidtrack.scan import Scan
from vidtrack.tracking.boxes import box_scan
from vidtrack.tracking.occlusion.occlusion import Occlusion
from vidtrack.tracking.occlusion.sharing import Exclusive
from vidtrack.tracks import Status
from vidtrack.video.frame import Frame
from vidtrack.video.source import open_source

CROSSING = SAMPLES / "crossing.avi"


def test_track_yields_each_frame_with_its_tracks():
    seen = list(track(CROSSING))
    assert [frame.index for frame, _ in seen] == list(range(150))
    assert all(frame.time_s == tracks.t for frame, tracks in seen)
    assert all(a.time_s < b.time_s for (a, _), (b, _) in pairwise(seen))
    assert seen[0][0].bgr().shape == (240, 320, 3)
    known = {int(i) for _, tracks in seen for i in tracks.id[tracks.status != Status.TENTATIVE]}
    assert len(known) == 2


def test_whoever_looks_at_the_pictures_gets_whole_ones_of_the_first_seconds_too(tmp_path):
    """The detector looks at half of 320 x 240; what it has seen ahead may be kept so for itself alone."""
    settings = load(assignments=["source.scale=0.5"])
    frame, _ = next(track(CROSSING, settings))
    assert frame.y.shape == (240, 320)
    with run_file(str(CROSSING), settings, tmp_path / "out", Extras(video=tmp_path / "shown.mp4")) as run:
        step = next(iter(run))
    assert step.frame is not None
    assert step.frame.y.shape == (240, 320)


def test_track_is_lazy_and_may_be_left():
    frames = track(CROSSING, load(assignments=["tracker.method=nn"]))
    assert [frame.index for frame, _ in islice(frames, 3)] == [0, 1, 2]
    frames.close()


def test_a_missing_video_is_told_when_the_first_frame_is_asked_for():
    frames = track("nowhere.avi")
    with pytest.raises(SourceError, match=r"nowhere\.avi"):
        next(frames)


def test_the_crossing_vehicles_keep_their_identities(tmp_path):
    with run_file(str(CROSSING), Settings(), tmp_path / "out") as run:
        for _ in run:
            pass
    scores = score.evaluate(formats.read(tmp_path / "out"), formats.read(SAMPLES / "crossing.txt"), iou=0.3)
    assert scores["switches"] == 0
    assert scores["tracks"] == scores["truth_tracks"] == 2
    assert scores["idf1"] > 0.9


def test_steps_carry_everything_about_a_frame():
    settings = load(assignments=["source.end_s=2"])
    with open_source(str(CROSSING), settings.source) as source:
        tracker = build_blob_tracker(settings.tracker, (source.width, source.height))
        steps = list(video_steps(source, build_detector(settings), tracker, settings))
    last = steps[-1]
    assert last.foreground.mask.shape == last.frame.shape
    assert len(last.scan) >= 2
    assert last.scan.box.shape == (len(last.scan), 4)
    assert set(last.stage_s) == {"read", "detect", "blobs", "track"}
    assert all(seconds >= 0 for seconds in last.stage_s.values())


def test_what_the_mask_hides_is_not_tracked(tmp_path):
    import cv2

    mask = np.zeros((240, 320), np.uint8)
    mask[:, 200:] = 255
    cv2.imwrite(str(tmp_path / "mask.png"), mask)
    settings = load(assignments=[("source.mask", tmp_path / "mask.png")])
    seen = [tracks.xy for _, tracks in track(CROSSING, settings)]
    xy = np.concatenate(seen)
    assert len(xy)
    assert (xy[:, 0] > 190).all()


def test_a_mask_that_is_no_picture_is_refused(tmp_path):
    (tmp_path / "mask.png").write_text("no picture")
    with pytest.raises(ConfigError, match=r"mask\.png"):
        build_detector(load(assignments=[("source.mask", tmp_path / "mask.png")]))


def test_only_vehicles_that_drove_protect_the_scene():
    """A confirmed track 1.5 times its size from where it began has driven; what a car left behind has not."""
    tracker = build_blob_tracker(TrackerSettings(), (320, 240))
    box = np.tile([-10.0, -5.0, 20.0, 10.0], (2, 1))
    driven = []
    for k in range(20):
        z = np.array([[50.0 + 2 * k, 80.0], [200.0 + 8 * (k > 0), 150.0]])
        driven.append(has_driven(tracker.step(Scan(0.04 * k, z, np.eye(2), box=box))).tolist())
    assert driven[14] == [False, False]
    assert driven[-1] == [True, False]


def test_what_came_in_over_the_border_has_driven_half_as_far_as_others_have_to():
    """A vehicle half as long as the picture stops soon after it is inside."""
    tracker = build_blob_tracker(TrackerSettings(), (320, 240))
    for k in range(60):
        right = min(10.0 + 6 * k, 220.0)
        left = max(right - 160, 0.0)
        box = np.array([[left - right, -80, 2 * (right - left), 160]]) / 2
        tracks = tracker.step(Scan(0.04 * k, np.array([[(left + right) / 2, 120.0]]), np.eye(2), box=box))
    assert 0.75 * 160 < tracks.travel[0] < 1.5 * 160
    assert has_driven(tracks).tolist() == [True]


@pytest.mark.parametrize("method", ["nn", "gnn"])
@pytest.mark.parametrize("distance", ["mahalanobis", "decoupled", "euclidean"])
def test_settings_reach_the_tracker(method, distance):
    settings = load(
        assignments=[f"tracker.method={method}", f"tracker.distance={distance}", "tracker.merged_blobs=false"]
    )
    tracker = build_blob_tracker(settings.tracker)
    assert type(tracker.timing.rule).__name__.lower() == method
    assert tracker.gate.distance == distance
    assert tracker.sharing == Exclusive()


@pytest.mark.parametrize(("method", "sharing"), [("gnn", Occlusion()), ("mht", Exclusive()), ("split", Exclusive())])
def test_blobs_are_shared_where_decisions_do_not_wait(method, sharing):
    settings = load(assignments=[f"tracker.method={method}"])
    assert build_blob_tracker(settings.tracker).sharing == sharing
    assert build_box_tracker(settings.tracker, settings.detections).sharing == Exclusive()


def test_boxes_of_a_detector_become_tracks_with_identities():
    tracker = box_tracker(bounds=(640, 360))
    for k in range(30):
        t = k / 25
        tracks = tracker.step(box_scan(t, [[10 + 90 * t, 50, 40, 20], [300 - 60 * t, 80, 40, 20]] if k != 20 else []))
    assert tracks.id.tolist() == [1, 2]
    assert (tracks.status == Status.CONFIRMED).all()
    np.testing.assert_allclose(tracks.box, [[114.4, 50, 40, 20], [230.4, 80, 40, 20]], atol=3)
    np.testing.assert_allclose(tracks.v, [[90, 0], [-60, 0]], atol=5)


def test_stored_detections_are_seen_with_a_probability_of_their_own():
    settings = load(assignments=["tracker.detection_probability=0.7", "detections.detection_probability=0.6"])
    assert build_blob_tracker(settings.tracker).rates.detection_probability == 0.7
    assert build_box_tracker(settings.tracker, settings.detections).rates.detection_probability == 0.6


def test_a_mirrored_video_gives_mirrored_tracks():
    def mirrored(frame):
        y, u, v = (np.ascontiguousarray(plane[:, ::-1]) for plane in (frame.y, frame.u, frame.v))
        return Frame(frame.index, frame.time_s, y, u, v, frame.full_range)

    def tracks(frames):
        bounds = frames[0].shape[::-1]
        tracker = build_blob_tracker(Settings().tracker, bounds)
        return [step.tracks for step in video_steps(frames, build_detector(Settings()), tracker, Settings())]

    with open_source(str(SAMPLES / "junction.avi"), SourceSettings()) as source:
        frames = list(source)
    width = frames[0].shape[1]
    for a, b in zip(tracks(frames), tracks([mirrored(frame) for frame in frames]), strict=True):
        seen, other = (t.only(t.status != Status.TENTATIVE) for t in (a, b))
        assert len(seen) == len(other)
        x = np.sort(seen.xy[:, 0])
        assert np.abs(x - np.sort(width - 1 - other.xy[:, 0])).max(initial=0) < 0.5


def test_a_site_says_where_tracks_stand(tmp_path):
    """Seen from straight above, 10 px a metre: speeds are those in the picture."""
    corners = [[0, 0], [319, 0], [319, 239], [0, 239]]
    ground = [[x / 10, -y / 10] for x, y in corners]
    text = f'[site]\nname = "a"\nwidth = 320\nheight = 240\n[calibration]\npicture = {corners}\nground = {ground}\n'
    (tmp_path / "site.toml").write_text(text)
    known = 0
    for frame, tracks, stand in track(CROSSING, site=tmp_path / "site.toml"):
        assert len(stand.xy) == len(tracks)
        moving = np.isfinite(stand.xy[:, 0]) & (np.linalg.norm(tracks.v, axis=1) > 20)
        assert stand.speed[moving] == pytest.approx(np.linalg.norm(tracks.v[moving], axis=1) / 10, rel=0.01)
        known += int(moving.sum())
        if frame.time_s > 3:
            break
    assert known > 20
    (tmp_path / "bare.toml").write_text(text.partition("[calibration]")[0])
    with pytest.raises(ConfigError, match="no section"):
        next(track(CROSSING, site=tmp_path / "bare.toml"))
