"""The robust disturbance map, on drawn scenes with known answers."""

from __future__ import annotations

from dataclasses import replace
from typing import get_args

import cv2
import numpy as np
import pytest

from vidtrack.config.names import Detector
from vidtrack.config.video import BlobSettings, DetectorSettings
from vidtrack.errors import Error
from vidtrack.video.background import create
from vidtrack.video.background.picture import reduction
from vidtrack.video.blobs.blobs import find_blobs
from vidtrack.video.frame import Frame

NONE_KNOWN = np.empty((0, 4))
CAR = (40, 24)  # width, height


class Street:
    """A textured road with sensor noise; what moves on it is painted per frame."""

    def __init__(self, shape=(120, 160), seed=1, colour=True):
        self.rng = np.random.default_rng(seed)
        coarse = self.rng.uniform(90, 150, (shape[0] // 8 + 1, shape[1] // 8 + 1))
        self.road = np.kron(coarse, np.ones((8, 8)))[: shape[0], : shape[1]]
        self.half = ((shape[0] + 1) // 2, (shape[1] + 1) // 2)
        self.colour = colour

    def frame(self, time_s, cars=(), light=1.0, region=None):
        """cars: (left, top, grey level); region: (slice, slice, values) painted over the road."""
        y = self.road * light
        if region is not None:
            y[region[0], region[1]] = region[2]
        for left, top, grey in cars:
            y[top : top + CAR[1], max(left, 0) : max(left + CAR[0], 0)] = grey
        y = np.clip(y + self.rng.normal(0, 2, y.shape), 0, 255).astype(np.uint8)
        chroma = np.full(self.half, 128, np.uint8) if self.colour else None
        if chroma is not None:
            chroma[:2] = 140  # the verge: a picture with no colour anywhere is that of a camera without
        return Frame(round(time_s * 25), time_s, y, chroma, chroma, full_range=True)


def disturbance(scale=None, keep=None, **settings):
    return create(DetectorSettings.model_validate({"kind": "disturbance", "disturbance": settings}), scale, keep)


def play(detector, street, seconds, start=0.0, fps=10, known=NONE_KNOWN, **scene):
    """Show the same scene for a while; the last foreground."""
    for k in range(round(seconds * fps)):
        foreground = detector.apply(street.frame(start + k / fps, **scene), known)
    return foreground


def covered(foreground, left, top):
    """Share of the car's place that is foreground."""
    return (foreground.mask[top : top + CAR[1], left : left + CAR[0]] > 0).mean()


@pytest.mark.parametrize("colour", [True, False])
def test_an_empty_road_shows_nothing_and_a_car_shows_whole(colour):
    street, detector = Street(colour=colour), disturbance()
    assert not play(detector, street, 2).mask.any()
    foreground = play(detector, street, 0.1, start=2, cars=[(60, 50, 230)])
    assert covered(foreground, 60, 50) > 0.95
    assert (foreground.mask > 0).sum() < 1.15 * CAR[0] * CAR[1]
    assert foreground.strength[60, 80] > 3
    assert set(np.unique(foreground.mask)) == {0, 255}


def test_a_car_of_the_road_s_luminance_is_seen_by_its_colour():
    street, detector = Street(), disturbance()
    play(detector, street, 1)
    frame = street.frame(1.0)
    frame.v[25:37, 30:50] = 170
    assert covered(detector.apply(frame, NONE_KNOWN), 60, 50) > 0.9


def test_a_far_vehicle_of_few_pixels_is_seen():
    street, detector = Street((240, 320)), disturbance()
    play(detector, street, 1)
    foreground = play(detector, street, 0.1, start=1, region=(slice(50, 55), slice(100, 106), 230))
    assert len(find_blobs(foreground, BlobSettings())) == 1


def test_a_stopped_car_that_does_not_change_is_absorbed_after_steady_s():
    street, detector = Street(), disturbance()
    play(detector, street, 2)
    assert covered(play(detector, street, 3.5, start=2, fps=5, cars=[(60, 50, 230)]), 60, 50) > 0.95
    assert not play(detector, street, 2.5, start=5.5, fps=5, cars=[(60, 50, 230)]).mask.any()


def test_what_changes_while_it_stands_stays_until_absorb_s():
    street, detector = Street(), disturbance(absorb_s=10.0)
    play(detector, street, 2)
    for k in range(100):
        t = 2 + k / 10
        foreground = detector.apply(street.frame(t, cars=[(60, 50, 200 + 50 * (k % 2))]), NONE_KNOWN)
        if 0.5 < t - 2 < 9.5:
            assert covered(foreground, 60, 50) > 0.95, t
    assert covered(play(detector, street, 2, start=12, cars=[(60, 50, 250)]), 60, 50) < 0.05


def test_a_known_car_is_never_absorbed():
    street, detector = Street(), disturbance(absorb_s=10)
    play(detector, street, 2)
    known = np.array([[58.0, 48.0, 44.0, 28.0]])
    assert covered(play(detector, street, 40, start=2, fps=5, known=known, cars=[(60, 50, 230)]), 60, 50) > 0.95


def test_a_moving_car_leaves_no_tail():
    street, detector = Street(), disturbance()
    play(detector, street, 1)
    for k in range(20):
        left = 5 * k
        foreground = detector.apply(street.frame(1 + k / 10, cars=[(left, 50, 200)]), NONE_KNOWN)
        columns = np.flatnonzero(foreground.mask.any(axis=0))
        assert columns.min() >= left - 2
        assert columns.max() <= left + CAR[0] + 1


def test_a_car_of_the_first_frame_leaves_no_ghost():
    street, detector = Street(), disturbance()
    for k in range(30):
        foreground = detector.apply(street.frame(k / 10, cars=[(30 + 12 * k, 50, 220)]), NONE_KNOWN)
        if k >= 25:
            assert (foreground.mask > 0).sum() < 0.01 * CAR[0] * CAR[1]


def zebra(street):
    """Paint bright bars on the road; the place of a car on them."""
    street.road[44:80, 50:110] = 100
    for left in range(50, 110, 8):
        street.road[44:80, left : left + 4] = 220
    return 60, 50


def test_road_marks_reappear_at_once_when_a_car_leaves_them():
    street, detector = Street(), disturbance()
    left, top = zebra(street)
    play(detector, street, 2)
    play(detector, street, 8, start=2, cars=[(left, top, 60)])  # plain grey on bars: it looks like a ghost
    assert not play(detector, street, 0.2, start=10).mask.any()


def test_a_known_car_on_road_marks_is_not_taken_for_a_ghost():
    street, detector = Street(), disturbance()
    left, top = zebra(street)
    play(detector, street, 2)
    known = np.array([[left - 2.0, top - 2.0, CAR[0] + 4.0, CAR[1] + 4.0]])
    assert covered(play(detector, street, 8, start=2, known=known, cars=[(left, top, 60)]), left, top) > 0.95


def test_a_soft_shadow_is_not_foreground():
    street, detector = Street(), disturbance()
    play(detector, street, 2)
    place = np.s_[50:74], np.s_[60:100]
    foreground = play(detector, street, 0.3, start=2, region=(*place, 0.6 * street.road[place]))
    assert covered(foreground, 60, 50) < 0.15
    assert covered(play(disturbance(shadow=False), street, 2), 60, 50) == 0


def shown_after(factor, seen_through):
    """Share that is foreground of what drove past for 4 s, with `factor` times the road's light; it may be a shadow."""
    street, detector = Street(), disturbance()
    play(detector, street, 2)
    for k in range(40):
        place = np.s_[50:74], np.s_[2 * k : 2 * k + 40]
        values = factor * (street.road[place] if seen_through else street.road.mean())
        detector.apply(street.frame(2 + k / 10, region=(*place, values)), NONE_KNOWN)
    return covered(play(detector, street, 0.1, start=6, region=(*place, values)), place[1].start, 50)


@pytest.mark.parametrize("factor", [0.3, 0.35, 0.4, 0.45])
def test_in_sunlight_hard_shadow_is_learnt_not_to_be_foreground(factor):
    assert shown_after(factor, seen_through=True) < 0.15


@pytest.mark.parametrize("factor", [0.3, 0.35, 0.4, 0.45])
def test_a_dark_car_does_not_pass_for_hard_shadow(factor):
    assert shown_after(factor, seen_through=False) > 0.9


def test_the_shadow_of_a_person_is_not_foreground_though_it_is_all_edge():
    street, detector = Street(), disturbance()
    play(detector, street, 2)
    light = np.ones(street.road.shape)
    light[50:56, 60:76] = 0.55
    light = cv2.GaussianBlur(light, (0, 0), 1.3)
    whole = np.s_[:, :, light * street.road]
    assert not play(detector, street, 0.3, start=2, region=whole).mask.any()

    untested = disturbance(shadow=False)
    play(untested, street, 2)
    assert play(untested, street, 0.3, start=2, region=whole).mask.any()


@pytest.mark.parametrize("sent", ["luminance alone", "grey in colour"])
def test_a_dark_patterned_car_shows_whole_though_no_colour_tells_it_from_shadow(sent):
    street, detector = Street(colour=False), disturbance()
    if sent == "grey in colour":
        grey, luminance = np.full(street.half, 128, np.uint8), street.frame
        street.frame = lambda *args, **scene: replace(luminance(*args, **scene), u=grey, v=grey)
    play(detector, street, 2)
    stripes = np.where(np.arange(CAR[0]) % 8 < 4, 60, 90)
    foreground = play(detector, street, 0.3, start=2, region=(slice(50, 74), slice(60, 100), stripes))
    assert covered(foreground, 60, 50) > 0.9


@pytest.mark.parametrize("light", [0.6, 1.4])
def test_a_step_of_light_does_not_flood(light):
    street, detector = Street(), disturbance()
    play(detector, street, 2)
    for k in range(20):
        foreground = detector.apply(street.frame(2 + k / 10, light=light), NONE_KNOWN)
        assert (foreground.mask > 0).mean() < 0.1
    assert not foreground.mask.any()


@pytest.mark.parametrize(("red", "blue"), [(1.2, 0.85), (0.9, 1.1)])
def test_a_change_of_white_balance_does_not_flood_and_a_coloured_car_shows(red, blue):
    street, detector = Street(), disturbance()
    play(detector, street, 2)
    for k in range(20):
        share = min(1.0, k / 10)
        frame = tinted(street.frame(2 + k / 10), 1 + share * (red - 1), 1 + share * (blue - 1))
        assert not detector.apply(frame, NONE_KNOWN).mask.any(), k
    frame = street.frame(4.0)
    frame.v[25:37, 30:50] += 35
    assert covered(detector.apply(tinted(frame, red, blue), NONE_KNOWN), 60, 50) > 0.9


def tinted(frame, red, blue):
    """A frame whose red and blue are amplified by these factors."""
    picture = frame.bgr() * np.array([blue, 1.0, red])
    y, u, v = cv2.split(cv2.cvtColor(picture.astype(np.float32) / 255, cv2.COLOR_BGR2YCrCb)[..., [0, 2, 1]])
    half = [np.rint(255 * plane[::2, ::2]).clip(0, 255).astype(np.uint8) for plane in (u, v)]
    return replace(frame, y=np.rint(255 * y).clip(0, 255).astype(np.uint8), u=half[0], v=half[1])


def test_another_view_is_learnt_in_seconds_and_does_not_flood():
    street, other, detector = Street(seed=1), Street(seed=2), disturbance()
    other.road = 240 - other.road[::-1] * 1.2
    play(detector, street, 2)
    for k in range(25):
        foreground = detector.apply(other.frame(2 + k / 10), NONE_KNOWN)
    assert not foreground.mask.any()
    assert covered(play(detector, other, 0.1, start=4.5, cars=[(60, 50, 250)]), 60, 50) > 0.95


def test_a_swaying_region_becomes_quiet():
    street, detector = Street(), disturbance()
    tree = np.s_[20:60], np.s_[20:60]
    leaves = street.rng.uniform(60, 140, (48, 48))
    shown = []
    for k in range(200):
        dx, dy = street.rng.integers(0, 3, 2)
        view = np.kron(leaves, np.ones((1, 1)))[dy : dy + 40, dx : dx + 40]
        shown.append((detector.apply(street.frame(k / 10, region=(*tree, view)), NONE_KNOWN).mask > 0).sum())
    assert np.mean(shown[-50:]) < 0.02 * leaves.size


def test_time_constants_are_seconds_at_any_rate():
    levels = []
    for fps in (10, 30):
        street, detector = Street(), disturbance(exposure=False)
        play(detector, street, 3, fps=fps)
        street.road = street.road + 10  # below the threshold: learnt like any slow change
        play(detector, street, 2, start=3, fps=fps)
        levels.append(detector.scene().mean())
    assert abs(levels[0] - levels[1]) < 0.5


def test_a_gap_in_time_does_no_harm():
    street, detector = Street(), disturbance()
    play(detector, street, 2)
    play(detector, street, 0.5, start=100)
    assert not play(detector, street, 0.5, start=100.5).mask.any()


def test_nothing_is_foreground_where_the_keep_picture_is_black():
    street = Street()
    keep = np.zeros((60, 80), np.uint8)
    keep[:, :40] = 255
    detector = disturbance(keep=keep)
    play(detector, street, 1)
    foreground = play(detector, street, 0.1, start=1, cars=[(60, 50, 230)])
    assert covered(foreground, 60, 50) == pytest.approx(0.5, abs=0.05)
    assert not foreground.mask[:, 80:].any()


@pytest.mark.parametrize(
    ("rows", "step"),
    [(120, 1), (240, 1), (480, 1), (500, 1), (540, 2), (576, 2), (720, 2), (1080, 3), (1440, 3), (2160, 5)],
)
def test_large_pictures_are_reduced_to_at_most_500_rows(rows, step):
    assert reduction(rows, None) == step
    assert rows / step <= 500


@pytest.mark.parametrize("kind", get_args(Detector))
@pytest.mark.parametrize(
    ("shape", "scale"), [((121, 163), None), ((97, 131), 0.5), ((241, 323), 0.34), ((2160, 3840), None)]
)
def test_every_detector_takes_odd_and_large_pictures(kind, shape, scale):
    street = Street(shape)
    detector = create(DetectorSettings(kind=kind), scale)
    for k in range(10 if kind == "knn" else 2):  # OpenCV's KNN tells its scene after some frames
        foreground = detector.apply(street.frame(k / 10), NONE_KNOWN)
    assert foreground.mask.shape == foreground.strength.shape
    assert foreground.full_size(shape).shape == shape
    assert detector.scene().shape == (*shape, 3)
    assert abs(detector.scene().mean() - street.road.mean()) < 5


@pytest.mark.parametrize("kind", get_args(Detector))
def test_a_scene_before_the_first_frame_is_refused(kind):
    with pytest.raises(Error, match="first frame"):
        create(DetectorSettings(kind=kind)).scene()


def test_the_window_must_have_a_middle():
    with pytest.raises(ValueError, match="odd"):
        disturbance(majority_px=6)
