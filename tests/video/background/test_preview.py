"""The scene is learnt from a video's first seconds before its first frame is examined."""

from __future__ import annotations

import logging
from threading import get_ident

import cv2
import numpy as np
import pytest

from vidtrack.arrays import affine
from vidtrack.config.inputs import Input
from vidtrack.config.load import load
from vidtrack.config.settings import SourceSettings
from vidtrack.config.video import DetectorSettings
from vidtrack.errors import ConfigError
from vidtrack.run.video import build_detector, look_ahead, track
from vidtrack.video import source as source_module
from vidtrack.video.background import create
from vidtrack.video.background.shadow import _HARD as HARD
from vidtrack.video.background.shadow import SOFT, Sunlight
from vidtrack.video.frame import Frame
from vidtrack.video.pictures import ImageSequence
from vidtrack.video.source import open_source

SHAPE, MARGIN, FPS = (120, 160), 20, 10
CAR = (slice(50, 74), slice(60, 100))  # where it stands in the first frame
SPEED = 40  # px/s
NONE_KNOWN = np.empty((0, 4))


def frames(seconds, left, motion=lambda t: affine.IDENTITY, seed=1):
    """A car at `left`(t) [px], or none where that is None, seen by a camera that moves."""
    rng = np.random.default_rng(seed)
    size = (SHAPE[0] + 2 * MARGIN, SHAPE[1] + 2 * MARGIN)
    ground = cv2.resize(rng.uniform(80, 160, (size[0] // 8, size[1] // 8)), size[::-1])
    ground += cv2.GaussianBlur(rng.normal(0, 40, size), (0, 0), 1.5)
    grey = np.full((SHAPE[0] // 2, SHAPE[1] // 2), 128, np.uint8)
    for k in range(round(seconds * FPS)):
        world, x = ground.copy(), left(k / FPS)
        if x is not None:
            world[MARGIN + 50 : MARGIN + 74, MARGIN + x : MARGIN + x + 40] = 230
        to_picture = affine.after(motion(k / FPS), affine.shift(-MARGIN, -MARGIN))
        y = cv2.warpAffine(world, to_picture, SHAPE[::-1], flags=cv2.INTER_CUBIC) + rng.normal(0, 2, SHAPE)
        yield Frame(k, k / FPS, np.clip(y, 0, 255).astype(np.uint8), grey, grey, full_range=True)


def drives_off(t):
    x = round(60 + SPEED * t)
    return x if x < SHAPE[1] + 10 else None


def stands(t):
    return 60


def first_foreground(shown, seconds=5.0):
    """What is foreground in the first frame."""
    shown = list(shown)
    detector = create(DetectorSettings())
    detector.preview(frame for frame in shown if frame.time_s < seconds)
    return detector, detector.apply(shown[0], NONE_KNOWN)


def test_a_car_that_drives_off_is_foreground_in_the_first_frame_and_not_in_the_scene():
    shown = list(frames(6, drives_off))
    detector, found = first_foreground(shown)
    inside = found.mask[CAR] > 0
    assert inside.mean() > 0.95
    assert (found.mask > 0).sum() < 1.15 * inside.size
    assert abs(detector.scene()[..., 0].astype(int)[CAR].mean() - shown[-1].y[CAR].mean()) < 6
    for frame in shown[1:]:
        found = detector.apply(frame, NONE_KNOWN)
    assert not found.mask.any()


def test_a_car_that_stands_all_the_time_is_scene_as_without_a_preview():
    _, found = first_foreground(frames(6, stands))
    assert not found.mask.any()


def test_after_a_sway_in_the_preview_the_first_frame_is_the_place_of_the_tracks():
    def sway(t):
        return affine.shift(6 * np.sin(2 * t) + 3, 2 * np.sin(3 * t))

    _, found = first_foreground(frames(6, drives_off, sway))
    assert found.motion is None
    row, column = np.nonzero(found.mask)
    assert abs(column.min() - 63) <= 3  # the camera begins 3 px to the side
    assert abs(column.max() - 102) <= 3
    assert abs(row.min() - 50) <= 3


def test_a_preview_of_another_view_is_forgotten():
    here, there = frames(2, drives_off), frames(4, lambda t: None, seed=7)
    shown = [*here, *(Frame(20 + f.index, 2 + f.time_s, f.y, f.u, f.v, full_range=True) for f in there)]
    detector, _ = first_foreground(shown, 6.0)
    for frame in shown[1:18]:
        found = detector.apply(frame, NONE_KNOWN)
    assert not found.mask[:, :40].any()


def creeping(seconds, gain=lambda t: 1.0, cut_s=np.inf):
    """Three cars that creep along a road, a car's length apart; the light, and another view from a time on."""
    grey = np.full((SHAPE[0] // 2, SHAPE[1] // 2), 128, np.uint8)
    road = next(frames(1, lambda t: None)).y.astype(float)
    road[72:] = 100  # a smooth dark lane and grass
    other = next(frames(1, lambda t: None, seed=9)).y.astype(float)
    for k in range(round(seconds * FPS)):
        picture = road.copy()
        for n in range(-2, 4):
            left = round(5 * k / FPS) + 48 * n
            picture[84:104, max(left, 0) : max(left + 30, 0)] = (200, 50, 150)[n % 3]
        shown = other if k / FPS >= cut_s else gain(k / FPS) * picture
        y = shown + np.random.default_rng(k).normal(0, 2, SHAPE)
        yield Frame(k, k / FPS, np.clip(y, 0, 255).astype(np.uint8), grey, grey, full_range=True)


def scene_of(shown, patches):
    detector = create(DetectorSettings.model_validate({"disturbance": {"patches": patches}}))
    detector.preview(shown)
    return detector.scene()[..., 0].astype(int)


@pytest.mark.parametrize("gain", [lambda t: 1.0, lambda t: 1 - 0.03 * t])
def test_the_road_that_a_queue_hides_is_taken_from_pictures_that_show_it(gain):
    lane = slice(84, 104)
    wrong = {on: (np.abs(scene_of(creeping(10, gain), on)[lane] - 100) > 30).sum() for on in (True, False)}
    assert wrong[True] < 0.7 * wrong[False]


def test_after_a_cut_no_patch_is_of_the_other_view():
    shown = list(creeping(10, cut_s=1.2))
    assert np.array_equal(scene_of(shown, True), scene_of(shown, False))


def test_one_frame_is_no_preview():
    shown = next(frames(1, stands))
    detector = create(DetectorSettings())
    detector.preview([shown])
    assert not detector.apply(shown, NONE_KNOWN).mask.any()


def test_the_opening_is_the_frames_of_the_span_and_tells_no_warning_twice(tmp_path, caplog):
    for k in range(12):
        picture = np.full((48 if k < 9 else 96, 64 if k < 9 else 128), 10 * k, np.uint8)
        cv2.imwrite(str(tmp_path / f"{k:03d}.png"), picture)
    caplog.set_level(logging.WARNING)
    with open_source(str(tmp_path), SourceSettings(start_s=0.12, end_s=0.44)) as source:
        ahead = list(source.opening(0.3, 0.44))
        whole = list(source)
    assert [frame.time_s for frame in ahead] == pytest.approx([frame.time_s for frame in whole if frame.time_s < 0.43])
    assert all(np.array_equal(a.y, b.y) for a, b in zip(ahead, whole, strict=False))
    assert sum("carries no time" in record.message for record in caplog.records) == 1


@pytest.mark.parametrize(("end_s", "room", "again"), [(None, 10**6, 0), (None, 10**4, 1), (0.2, 10**6, 1)])
def test_an_opening_is_read_twice_only_if_it_is_large_or_longer_than_the_source(
    tmp_path, monkeypatch, end_s, room, again
):
    for k in range(12):
        cv2.imwrite(str(tmp_path / f"{k:03d}.png"), np.full((48, 64), 10 * k, np.uint8))
    begun, between = [], ImageSequence.between
    monkeypatch.setattr(ImageSequence, "between", lambda self, *span: begun.append(span) or between(self, *span))
    monkeypatch.setattr("vidtrack.video.source._KEPT_BYTES", room)
    with open_source(str(tmp_path), SourceSettings(fps=10, end_s=end_s)) as source:
        ahead = [frame.y[0, 0] for frame in source.opening(0.5, None)]
        whole = [(frame.index, frame.y[0, 0]) for frame in source]
    assert ahead == [0, 10, 20, 30, 40, 50]
    assert whole == [(k, 10 * k) for k in range(12 if end_s is None else 3)]
    assert source.stats.frames_read == len(whole)
    assert len(begun) == again


@pytest.mark.parametrize(("rim", "preview_s"), [(0, 10), (1, 10), (3, 10), (1, 0.5), (1, 0)])
def test_pictures_that_are_read_reduced_show_the_detector_what_whole_ones_do(tmp_path, rim, preview_s):
    for k, frame in enumerate(frames(2, drives_off)):
        y = cv2.copyMakeBorder(frame.y, 0, rim, 0, rim, cv2.BORDER_REPLICATE)
        cv2.imwrite(str(tmp_path / f"{k:03d}.png"), cv2.merge([y, y, 255 - y]))
    settings = load(assignments=["source.fps=10", "source.scale=0.5", f"detector.disturbance.preview_s={preview_s}"])
    shapes, masks = [], []
    for whole in (True, False):
        with open_source(str(tmp_path), settings.source) as source:
            detector = build_detector(settings)
            look_ahead(source, detector, settings, whole=whole)
            shown = list(source)
        shapes.append([(frame.shape, frame.y.shape) for frame in shown])
        masks.append([detector.apply(frame, NONE_KNOWN).mask for frame in shown])
    full, half = (SHAPE[0] + rim, SHAPE[1] + rim), (SHAPE[0] // 2, SHAPE[1] // 2)  # the rim fills no window
    assert shapes[0] == [(full, full)] * 20
    assert shapes[1][-10:] == [(full, half)] * 10  # the first ones may have been read before
    assert preview_s == 0 or shapes[1] == [(full, half)] * 20
    assert np.any(masks[0])
    np.testing.assert_array_equal(masks[0], masks[1])


def test_frames_are_first_reduced_by_the_caller_then_by_the_reading_thread(tmp_path):
    for k in range(30):
        cv2.imwrite(str(tmp_path / f"{k:03d}.png"), np.full((48, 64), k, np.uint8))
    threads = []

    def noted(frame):
        threads.append(get_ident())
        return frame

    with open_source(str(tmp_path), SourceSettings(fps=10)) as source:
        source.reduce_by(noted)
        assert threads[0] == get_ident()
        assert [frame.y[0, 0] for frame in source] == list(range(30))
    later = set(threads[1:])
    assert len(later) == 1
    assert get_ident() not in later


def test_the_frames_of_an_opening_are_in_memory_of_their_own(tmp_path, monkeypatch):
    decoded, matched_as_before = [], source_module.matched
    monkeypatch.setattr(source_module, "matched", lambda *of: decoded.append(matched_as_before(*of)) or decoded[-1])
    for k in range(6):
        cv2.imwrite(str(tmp_path / f"{k:03d}.png"), np.full((48, 64), k, np.uint8))
    with open_source(str(tmp_path), SourceSettings(fps=10)) as source:
        ahead = list(source.opening(0.5, None))
    assert len(ahead) == 6
    assert not any(np.shares_memory(held.y, frame.y) for held in ahead for frame in decoded)


def test_a_camera_has_no_preview_and_zero_seconds_are_none(tmp_path):
    for setting in ("preview_s=3", "patches=false"):
        with pytest.raises(ConfigError, match="has no effect on a camera"):
            load(assignments=[f"detector.disturbance.{setting}"], kind=Input.CAMERA)
    for k, frame in enumerate(frames(2, drives_off)):
        cv2.imwrite(str(tmp_path / f"{k:03d}.png"), frame.y)
    ghost = {}
    for seconds in (0, 2):
        settings = load(assignments=[f"detector.disturbance.preview_s={seconds}"])
        with open_source(str(tmp_path), settings.source) as source:
            detector = build_detector(settings)
            look_ahead(source, detector, settings)
            ghost[seconds] = detector.apply(next(source), NONE_KNOWN).mask.any()
    assert ghost == {0: False, 2: True}
    assert len(list(track(tmp_path, load(assignments=["source.fps=10"])))) == 20


@pytest.mark.parametrize(("ahead", "sunlight", "seconds"), [(True, HARD, 5), (True, SOFT, 1), (False, HARD, 1)])
def test_shadow_becomes_scene_late_after_a_preview_in_the_sun(monkeypatch, ahead, sunlight, seconds):
    waits = []
    monkeypatch.setattr(Sunlight, "tolerance", sunlight)
    shown = list(frames(3, stands))
    detector = create(DetectorSettings())
    if ahead:
        detector.preview(shown)
    monkeypatch.setattr("vidtrack.video.background.disturbance.absorb", lambda *given: waits.append(float(given[-1])))
    for frame in shown:
        detector.apply(frame, NONE_KNOWN)
    assert set(waits) == {seconds}
