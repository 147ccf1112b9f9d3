"""A camera that moves a little: known motions are found, and traffic is seen through them."""

from __future__ import annotations

import logging

import cv2
import numpy as np
import pytest
from drawn_tracks import drive

from vidtrack.arrays import affine
from vidtrack.config.load import load
from vidtrack.config.video import BlobSettings, DetectorSettings
from vidtrack.output.sink import Step
from vidtrack.run.trackers import build_blob_tracker
from vidtrack.run.video import build_detector, video_steps
from vidtrack.simulate import simulate_road
from vidtrack.traffic.lines import Line, LineCounter
from vidtrack.video.background import create
from vidtrack.video.background.picture import Picture
from vidtrack.video.background.scene import UNKNOWN, start
from vidtrack.video.blobs.blobs import find_blobs
from vidtrack.video.camera.camera import Camera
from vidtrack.video.camera.canvas import fitting, lay, recut
from vidtrack.video.frame import Frame

NONE_KNOWN = np.empty((0, 4))
SHAPE = (180, 240)
MARGIN = 80
FPS = 25


class World:
    """A textured ground larger than the picture; the camera sees a part of it, moved, turned, enlarged."""

    def __init__(self, seed=1):
        self.rng = np.random.default_rng(seed)
        size = (SHAPE[0] + 2 * MARGIN, SHAPE[1] + 2 * MARGIN)
        coarse = cv2.resize(self.rng.uniform(50, 200, (size[0] // 8, size[1] // 8)), size[::-1])
        fine = cv2.GaussianBlur(self.rng.normal(0, 60, size), (0, 0), 1.5)
        self.ground = np.clip(coarse + fine, 20, 235)

    def frame(self, index, motion=affine.IDENTITY, cars=()):
        """cars: left, top, width, height, level on the ground that the first picture shows."""
        ground = self.ground.copy()
        for left, top, width, height, level in cars:
            ground[MARGIN + top : MARGIN + top + height, MARGIN + left : MARGIN + left + width] = level
        to_picture = affine.after(motion, affine.shift(-MARGIN, -MARGIN))
        y = cv2.warpAffine(ground, to_picture, SHAPE[::-1], flags=cv2.INTER_CUBIC)
        y = np.clip(np.rint(y + self.rng.normal(0, 1, y.shape)), 0, 255).astype(np.uint8)
        grey = np.full((SHAPE[0] // 2, SHAPE[1] // 2), 128, np.uint8)
        return Frame(index, index / FPS, y, grey, grey, full_range=True)


def turned(degrees, scale=1.0, x=0.0, y=0.0):
    """A motion about the picture's middle."""
    motion = cv2.getRotationMatrix2D((SHAPE[1] / 2, SHAPE[0] / 2), degrees, scale)
    motion[:, 2] += x, y
    return motion


def detector(**settings):
    return create(DetectorSettings.model_validate({"disturbance": settings}))


def settle(found, world, frames=30, **scene):
    for k in range(frames):
        found.apply(world.frame(k, **scene), NONE_KNOWN)
    return frames


def error(foreground, motion):
    """px by which a corner of the picture is off."""
    found = affine.IDENTITY if foreground.motion is None else foreground.motion
    return affine.displacement(found, SHAPE[1], SHAPE[0], motion)


@pytest.mark.parametrize(
    "motion",
    [
        affine.shift(1.3, -0.8),
        affine.shift(-6.4, 3.7),
        affine.shift(17.25, -11.5),
        turned(0.6),
        turned(-1.0, x=4.2),
        turned(0, scale=1.01),
        turned(0.5, scale=0.985, x=-3.3, y=2.1),
    ],
)
def test_a_known_motion_is_found_to_a_tenth_of_a_pixel_behind_a_vehicle_that_covers_a_quarter(motion):
    world, found = World(), detector()
    k = settle(found, world)
    for _ in range(3):
        foreground = found.apply(world.frame(k, motion, cars=[(30, 40, 110, 100, 245)]), NONE_KNOWN)
        k += 1
    assert error(foreground, motion) < 0.1


@pytest.mark.parametrize("jump", [10.0, 14.0, 20.0])
def test_a_shake_past_a_stripe_of_a_crossing_is_not_taken_for_one_to_the_next_stripe(jump):
    world, found = World(), detector()
    rough = cv2.GaussianBlur(world.rng.normal(0, 20, world.ground.shape), (0, 0), 1.5)
    world.ground = 100 + rough
    world.ground[MARGIN + 20 : MARGIN + 160] += np.where(np.arange(world.ground.shape[1]) % 16 < 8, 90, 0)
    house = cv2.resize(world.rng.uniform(60, 210, (6, 10)), (50, 30))
    world.ground[MARGIN + 60 : MARGIN + 90, MARGIN + 90 : MARGIN + 140] = house
    k = settle(found, world)
    for n, x in enumerate((2, -2, 2, 0, jump, jump + 2, jump)):
        motion = affine.shift(float(x), 0.0)
        assert error(found.apply(world.frame(k + n, motion), NONE_KNOWN), motion) < 0.1


def test_a_camera_that_stands_is_left_alone():
    world, found = World(), detector()
    still = detector(registration=False)
    for k in range(60):
        frame = world.frame(k, cars=[(3 * k, 60, 40, 24, 240)])
        a, b = found.apply(frame, NONE_KNOWN), still.apply(frame, NONE_KNOWN)
        assert a.motion is None
        assert a.place is None
        assert np.array_equal(a.mask, b.mask)
        assert np.array_equal(a.strength, b.strength)


def sway(k):
    return affine.shift(6 * np.sin(0.9 * k), 4 * np.cos(0.7 * k) - 4)


def test_headlamps_that_sweep_over_a_dark_road_are_no_motion_of_the_camera():
    found = detector()
    for k, picture in enumerate(simulate_road("motorway", seed=1, size=(320, 180), seconds=4.0, light="night")):
        planes = cv2.cvtColor(picture, cv2.COLOR_BGR2YUV_I420)
        u, v = planes[180:].reshape(2, 90, 160)
        foreground = found.apply(Frame(k, k / FPS, planes[:180], u, v, full_range=False), NONE_KNOWN)
        assert foreground.motion is None
    assert foreground.dark


def test_a_swaying_camera_sees_nothing_on_an_empty_street_and_a_vehicle_where_it_is_in_the_scene():
    world, found = World(), detector()
    for k in range(75):
        foreground = found.apply(world.frame(k, sway(k)), NONE_KNOWN)
        assert not foreground.mask.any() or k < 3
    for k in range(75, 90):
        foreground = found.apply(world.frame(k, sway(k), cars=[(100, 80, 40, 24, 245)]), NONE_KNOWN)
    blobs = find_blobs(foreground, BlobSettings())
    assert len(blobs) == 1
    np.testing.assert_allclose(blobs.box[0], [100, 80, 40, 24], atol=2.5)
    seen = foreground.full_size(SHAPE)
    expected = affine.boxes(foreground.motion, np.array([[100.0, 80, 40, 24]]))[0]
    columns, rows = np.flatnonzero(seen.any(axis=0)), np.flatnonzero(seen.any(axis=1))
    np.testing.assert_allclose([columns[0], rows[0], len(columns), len(rows)], expected, atol=2.5)


def test_a_slow_drift_is_followed_farther_than_the_canvas_reaches():
    world, found = World(), detector()
    for k in range(400):
        motion = affine.shift(0.12 * k, -0.05 * k)
        foreground = found.apply(world.frame(k, motion), NONE_KNOWN)
        assert not foreground.mask.any()
    assert error(foreground, motion) < 0.7  # what was learnt while the first pixel was too little to be followed
    assert max(foreground.mask.shape) < 1.6 * max(SHAPE)


def test_after_a_knock_the_camera_is_only_watched_again_and_positions_stay():
    world, found = World(), detector(still_s=1)
    k = settle(found, world)
    knock = turned(0.4, x=7.4, y=-5.3)
    for _ in range(40):
        foreground = found.apply(world.frame(k, knock), NONE_KNOWN)
        assert not foreground.mask.any()
        k += 1
    assert foreground.mask.shape == SHAPE  # no canvas any more
    assert error(foreground, knock) < 0.15
    foreground = found.apply(world.frame(k, knock, cars=[(100, 80, 40, 24, 245)]), NONE_KNOWN)
    np.testing.assert_allclose(find_blobs(foreground, BlobSettings()).box[0], [100, 80, 40, 24], atol=2.5)


def test_what_is_surveyed_moves_with_the_camera_and_ends_where_whole_pixels_end():
    world, found = World(), detector()
    k = settle(found, world)
    np.testing.assert_array_equal(found.apply(world.frame(k), NONE_KNOWN).surveyed, [0, 0, 240, 180])
    moved = found.apply(world.frame(k + 1, affine.shift(8, -5)), NONE_KNOWN)
    np.testing.assert_allclose(moved.surveyed, [-8, 5, 232, 185], atol=0.2)


@pytest.mark.parametrize("size", [(2560, 1440), (1600, 1200), (1366, 768), (2048, 1536), (320, 240), (1920, 1080)])
def test_a_blob_at_the_edge_of_the_picture_is_cut_by_it_at_every_size(size):
    width, height = size
    detector, tracker = build_detector(load()), build_blob_tracker(load().tracker, size)
    rng = np.random.default_rng(3)
    ground = cv2.resize(rng.uniform(80, 140, (height // 40, width // 40)), size).astype(np.uint8)
    half = np.full((height // 2, width // 2), 128, np.uint8)
    for k in range(4):
        y = ground.copy()
        if k == 3:
            y[height // 2 : height // 2 + height // 8, width - width // 6 :] = 250
            y[height - height // 6 :, width // 4 : width // 4 + width // 8] = 250
        foreground = detector.apply(Frame(k, k / 25, y, half, half, full_range=True), NONE_KNOWN)
    scan = find_blobs(foreground, BlobSettings()).scan(k / 25)
    assert len(scan) == 2
    tracker.step(scan)
    box = scan.box.copy()
    box[:, :2] += scan.z
    cut = tracker.picture.border.sides(box)
    assert cut[:, 2].any()
    assert cut[:, 3].any()
    assert not cut[:, :2].any()


def test_new_ground_is_taken_as_it_comes_and_the_rest_of_the_canvas_stays_unknown():
    world = World()
    first = world.frame(0)
    scene = start(Picture(first.y, first.u, first.v))
    motion = affine.shift(-9.0, 4.0)  # the ground moves left and down, so the camera looks right and up
    cut = fitting(scene, motion, SHAPE)
    left, top = cut[:2]
    wide = recut(scene, *cut)
    motion = affine.after(motion, affine.shift(left, top))
    assert left % 2 == top % 2 == 0
    assert fitting(wide, motion, SHAPE) is None
    moved = world.frame(1, affine.shift(-9.0, 4.0))
    laid, span = lay(Picture(moved.y, moved.u, moved.v), motion, wide)
    inside = laid.luma[20 - top : 170 - top, 15 - left : 235 - left].astype(float)
    assert np.abs(inside - first.y[20:170, 15:235]).mean() < 2  # noise of both pictures
    seen = np.zeros(wide.luma.shape, bool)
    for y, (begin, end) in enumerate(span):
        seen[y, begin:end] = True
    assert (wide.noise[seen] < UNKNOWN).all()
    assert (wide.noise[~seen] >= UNKNOWN).any()
    assert wide.noise[60 - top, SHAPE[1] + 4 - left] > 3  # seen for the first time: by no means certain


def follow(world, motions, cars, lines=()) -> tuple[list[Step], LineCounter]:
    settings = load()
    frames = (world.frame(k, motion, cars(k)) for k, motion in enumerate(motions))
    counter, steps = LineCounter(lines), []
    for step in video_steps(
        frames, build_detector(settings), build_blob_tracker(settings.tracker, SHAPE[::-1]), settings
    ):
        counter.step(step.index, step.tracks)
        steps.append(step)
    counter.close()
    return steps, counter


def test_a_line_stays_on_the_road_while_the_camera_sways_over_it():
    def passing(k):  # stops just before the line, closer to it than the camera sways
        return [(max(-40, min(2 * k - 90, 118 - 40)), 80, 40, 24, 245)]

    steps, counter = follow(World(), [sway(k) for k in range(150)], passing, [Line("a", 120, 0, 120, 180)])
    assert sum(counter.totals()["a"].values()) == 0
    last = steps[-1]
    assert len(last.tracks) == 1
    np.testing.assert_allclose(last.tracks.box[0], [78, 80, 40, 24], atol=3)
    np.testing.assert_allclose(last.shown.box[0], affine.boxes(last.motion, last.tracks.box)[0], atol=1e-9)
    positions = np.array([step.tracks.xy[0] for step in steps[-30:]])
    assert positions.std(axis=0).max() < 0.3  # while the camera sways by several pixels

    crossing = follow(World(), [sway(k) for k in range(150)], lambda k: [(2 * k - 90, 80, 40, 24, 245)],
                      [Line("a", 120, 0, 120, 180)])[1]  # fmt: skip
    assert crossing.totals()["a"] == {"left": 0, "right": 1}


def test_a_camera_that_turns_away_is_told_once_and_nothing_is_confirmed_meanwhile(caplog):
    caplog.set_level(logging.WARNING)
    motions = [affine.shift(-0.9 * max(0, k - 25), 0) for k in range(110)]
    steps, _ = follow(World(), motions, lambda k: [])
    said = [warning for step in steps for warning in step.warnings]
    assert len(said) == 1
    assert "moved by more than a quarter" in said[0]
    assert sum("moved by more than a quarter" in record.message for record in caplog.records) == 1
    assert not any(len(step.tracks) and (step.tracks.status > 0).any() for step in steps)


def test_a_camera_that_never_holds_still_is_told_once_and_nothing_is_reported():
    world, found = World(), detector()
    k = settle(found, world)
    views = [World(seed) for seed in range(2, 8)]
    said, reported = [], 0
    for j in range(150):
        strange = views[j // 2 % len(views)].frame(k + j, cars=[(100, 80, 40, 24, 245)])
        foreground = found.apply(strange, NONE_KNOWN)
        said += foreground.warnings
        reported += foreground.mask.any()
    assert len(said) == 1
    assert "does not hold still" in said[0]
    assert reported < 5


def snowfall(k, rng):
    """Frame k of a road in faint light, before it flakes that are brighter than anything on it."""
    ground = cv2.GaussianBlur(np.random.default_rng(1).normal(60, 60, SHAPE), (0, 0), 5.0)
    light = np.clip(ground + rng.normal(0, 1, SHAPE), 0, 255).astype(np.uint8)
    for x, y in rng.integers(0, SHAPE[::-1], (150, 2)).tolist():
        cv2.circle(light, (x, y), 1, 235, -1)
    grey = np.full((SHAPE[0] // 2, SHAPE[1] // 2), 128, np.uint8)
    return Frame(k, k / FPS, light, grey, grey, full_range=True)


def test_flakes_in_the_first_picture_are_no_view_that_changes_again_and_again():
    found, rng = detector(), np.random.default_rng(5)
    for k in range(15 * FPS):
        found.apply(snowfall(k, rng), NONE_KNOWN)
    for k in range(15 * FPS, 17 * FPS):
        frame = snowfall(k, rng)
        frame.y[80:110, 80:140] = 200
        shown = found.apply(frame, NONE_KNOWN).mask[80:110, 80:140]
        assert (shown > 0).mean() > 0.9, k


def test_a_knock_is_no_traffic_where_nobody_measures_the_motion():
    world, blind = World(), detector(registration=False, relearn_share=1.0)
    seen = [blind.apply(world.frame(k), NONE_KNOWN) for k in range(3 * FPS)]
    seen += [blind.apply(world.frame(k, affine.shift(6, 4)), NONE_KNOWN) for k in range(3 * FPS, 5 * FPS)]
    assert not any(foreground.mask.any() for foreground in seen)


def test_points_are_chosen_again_where_there_were_too_few():
    luma = np.full(SHAPE, 100, np.uint8)
    luma[80:90, 100:120] = 160
    none = np.empty((0, 0), np.uint8)
    camera = Camera(still_s=10.0)
    camera.follow(luma, start(Picture(luma, none, none)), NONE_KNOWN, 0.0)
    assert not camera.fits
    luma = World().frame(0).y
    for time_s in (0.5, 1.5, 2.0):
        camera.follow(luma, start(Picture(luma, none, none)), NONE_KNOWN, time_s)
    assert camera.fits


def test_what_traffic_taught_is_forgotten_when_the_camera_looks_elsewhere():
    world, other, found = World(), World(9), detector()
    tracker = build_blob_tracker(load().tracker, SHAPE[::-1])
    drive(tracker.road.learn, lambda y: (40.0, 20.0), vehicles=6)
    k = settle(found, world)
    assert [found.apply(world.frame(k + j), NONE_KNOWN).elsewhere for j in range(5)] == 5 * [False]
    frames = (other.frame(k + 5 + j) for j in range(60))
    assert tracker.road.sizes.known
    steps = list(video_steps(frames, found, tracker, load()))
    assert sum(step.foreground.elsewhere for step in steps) == 1
    assert not tracker.road.sizes.known
