"""Vehicles on the road: their places, speeds and lengths from boxes in the picture, and the errors of these."""

import os
from pathlib import Path

import numpy as np
import pytest
from pinhole import HEIGHT, POINTS, WIDTH, Pinhole, site_of

from vidtrack.formats import read_mot
from vidtrack.traffic.boxes import partly_hidden, uncut
from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.footprint import Footprints, footprint, velocity
from vidtrack.traffic.site import Site

CAMERA = Pinhole()
GROUND = calibrated(site_of(CAMERA.picture(POINTS), POINTS))
SURE = np.diag([0.1, 0.1, 1.0, 1.0])[None]
CAR, VAN, PERSON = (4.5, 1.8, 1.5), (5.5, 2.0, 2.2), (0.5, 0.5, 1.7)


def seen(kind, xy, heading_deg, speed=15.0, camera=CAMERA):
    """Centroid (2,), its velocity (2,) and box (4,) of a vehicle on its way."""
    heading = np.radians(heading_deg)
    step = 0.02 * speed * np.array([np.sin(heading), np.cos(heading)])
    centroid, box = camera.vehicle(np.asarray(xy, float), heading, *kind)
    before, _ = camera.vehicle(xy - step, heading, *kind)
    after, _ = camera.vehicle(xy + step, heading, *kind)
    return centroid, (after - before) / 0.04, box


def placed(*sights, ground=GROUND, P=SURE, tracks=None, size=(WIDTH, HEIGHT)):
    xy, u, box = (np.array(column) for column in zip(*sights, strict=True))
    tracks = np.arange(len(xy)) if tracks is None else np.array(tracks)
    return Footprints(ground, size).place(tracks, np.arange(len(xy)) / 25, xy, u, np.repeat(P, len(xy), axis=0), box)


@pytest.mark.parametrize("heading", [0, 30, 90, 150, 180, 270])
@pytest.mark.parametrize("at", [(0, 20), (-4, 24), (3, 35)])
def test_a_car_is_where_it_is_and_as_fast_as_it_is(heading, at):
    stand = placed(seen(CAR, at, heading))
    assert np.linalg.norm(stand.xy[0] - at) < 0.4
    assert stand.speed[0] == pytest.approx(15, rel=0.05)
    assert abs((np.degrees(stand.heading[0]) - heading + 180) % 360 - 180) < 3
    assert abs(stand.length[0] - 4.5) < 0.3 + stand.length_sigma[0]
    assert stand.width[0] == pytest.approx(1.8, abs=0.3)


@pytest.mark.parametrize("kind", [CAR, VAN, PERSON])
def test_the_height_of_the_centroid_is_not_taken_for_speed(kind):
    """A centroid taken for a point of the road is too fast by its height over that under the camera."""
    xy, u, _ = sight = seen(kind, (2, 25), 90)
    as_on_road = np.linalg.norm(GROUND.metres((xy + u / 100)[None]) - GROUND.metres((xy - u / 100)[None])) * 50
    assert as_on_road > 1.09 * 15
    assert placed(sight).speed[0] == pytest.approx(15, rel=0.04)


def test_a_point_above_the_road_has_exactly_the_speed_of_the_road_under_it():
    """The velocity of one point at a height, below a middle that is known, has no error at all."""
    xy = np.array([[2.0, 25], [-3, 18], [4, 40]])
    v = np.array([[3.0, -12], [10, 0], [-5, 20]])
    for z in (0.0, 0.75, 2.0):
        u = (CAMERA.picture(xy + 1e-4 * v, z) - CAMERA.picture(xy - 1e-4 * v, z)) / 2e-4
        found, _ = velocity(GROUND, CAMERA.picture(xy, z), CAMERA.picture(xy), u)
        assert np.allclose(found, v, rtol=1e-5, atol=1e-5)


def test_a_sideways_lorry_is_no_wider_than_the_law_allows():
    stand = placed(seen((12.0, 2.5, 3.5), (0, 30), 90))
    assert stand.length[0] == pytest.approx(12, abs=1)
    assert stand.width[0] == pytest.approx(2.55)
    assert np.linalg.norm(stand.xy[0] - (0, 30)) < 0.6


def test_own_errors_have_the_covariance_that_is_given():
    """Noise on the track and on its box: the squared error over its covariance is chi-square on average."""
    rng = np.random.default_rng(0)
    xy, u, box = seen(CAR, (2, 25), 45, speed=4.0)
    P = np.diag([0.8, 0.8, 16.0, 16.0])
    P[0, 2] = P[2, 0] = P[1, 3] = P[3, 1] = 1.5
    count = 3000
    noise = rng.multivariate_normal(np.zeros(4), P, count)
    edge = rng.normal(0, 1, (count, 2))
    boxes = np.repeat(box[None], count, axis=0)
    boxes[:, :2] += noise[:, :2] + edge
    exact = placed((xy, u, box))
    found = Footprints(GROUND, (WIDTH, HEIGHT)).place(
        np.arange(count), np.zeros(count), xy + noise[:, :2], u + noise[:, 2:], np.repeat(P[None], count, axis=0), boxes
    )
    for off, cov in ((found.xy - exact.xy, found.xy_own), (found.v - exact.v, found.v_own)):
        nees = np.einsum("ni,nij,nj->n", off, np.linalg.inv(cov), off)
        assert 1.3 < nees.mean() < 2.3  # the shape of vehicles, of which this one is usual, is part of the covariance


def test_shared_errors_have_the_covariance_that_is_given():
    """Over many calibrations of one camera, a vehicle's speed varies as said."""
    rng = np.random.default_rng(1)
    xy, u, box = seen(CAR, (2, 25), 20)
    speeds = []
    for _ in range(60):
        site = site_of(CAMERA.picture(POINTS) + rng.normal(0, 1, POINTS.shape), POINTS, sigma_ground_m=0.001)
        speeds.append(placed((xy, u, box), ground=calibrated(site)).speed[0])
    said = np.linalg.norm(placed((xy, u, box)).speed_by_shared)
    assert 0.65 < np.std(speeds) / said < 1.45


def test_a_calibration_that_is_poor_does_not_make_a_vehicles_own_error_larger():
    poor = calibrated(site_of(CAMERA.picture(POINTS), POINTS, sigma_picture_px=5.0))
    sight = seen(CAR, (2, 25), 20)
    fine, rough = placed(sight), placed(sight, ground=poor)
    assert np.allclose(fine.v_own, rough.v_own)
    assert np.linalg.norm(rough.v_shared) > 2 * np.linalg.norm(fine.v_shared)


def test_the_rim_of_a_blob_is_no_part_of_the_vehicle():
    """3 px on each side, of a car 40 m away: else it is longer, and stands nearer to the camera."""
    xy, u, box = seen(CAR, (2, 40), 90)
    wide = box + np.array([-3, -3, 6, 6])
    one, road = (np.array([7]), np.zeros(1), xy[None], u[None], SURE), Footprints(GROUND, (WIDTH, HEIGHT))
    exact = placed((xy, u, box))
    for rim in (3.0, np.array([3.0])):
        told = road.place(*one, wide[None], rim=rim)
        assert np.allclose(told.xy, exact.xy)
        assert np.allclose(told.length, exact.length)
    assert placed((xy, u, wide)).xy[0, 1] < exact.xy[0, 1] - 0.5


def test_outside_the_hull_everything_is_empty_and_never_zero():
    stand = placed(seen(CAR, (0, 25), 0), seen(CAR, (0, 70), 0))
    for values in (stand.xy, stand.xy_own, stand.xy_shared, stand.v, stand.v_own, stand.v_shared, stand.speed):
        assert np.isfinite(values[0]).all()
        assert np.isnan(values[1]).all()
    for values in (stand.heading, stand.length, stand.length_sigma, stand.width, stand.speed_own_sigma):
        assert np.isnan(values[1])


def test_a_box_that_the_border_cuts_has_no_footprint():
    xy, u, box = seen(CAR, (0, 25), 0)
    cut = [(box[0], HEIGHT - box[3], box[2], box[3]), (0, *box[1:]), (WIDTH - box[2], *box[1:])]
    assert np.isnan(placed(*((xy, u, np.array(one)) for one in cut)).xy).all()


def test_a_box_that_the_border_may_cut_tells_no_heading():
    """A blob that comes in grows: its centroid goes another way than the vehicle, and the heading would stay."""
    xy, u, box = seen(CAR, (0, 25), 0)
    at_border = np.array([2.0, *box[1:]])
    stand = placed((xy, 5 * u[::-1], at_border), (xy, u, box), tracks=[7, 7])
    assert np.isnan(stand.heading[0])
    assert np.degrees(stand.heading[1]) == pytest.approx(0, abs=3)


def test_a_vehicle_that_stops_keeps_its_heading():
    moving, standing = seen(CAR, (2, 25), 45), seen(CAR, (2, 25), 45, speed=1e-6)
    stand = placed(moving, moving, standing, standing, tracks=[7, 8, 7, 9])
    assert np.degrees(stand.heading[2]) == pytest.approx(45, abs=3)
    assert np.allclose(stand.xy[2], stand.xy[0], atol=0.01)
    assert stand.speed[2] < 0.01 < stand.speed_own_sigma[2]
    assert np.isnan(stand.heading[3])  # never seen moving
    assert np.isnan(stand.length[3])
    assert np.linalg.norm(stand.xy[3] - (2, 25)) < 1.0


def test_headings_are_remembered_from_batch_to_batch():
    prints = Footprints(GROUND, (WIDTH, HEIGHT))
    for speed in (15.0, 1e-6, 1e-6):
        xy, u, box = seen(CAR, (2, 25), 45, speed)
        stand = prints.place(np.array([7]), np.zeros(1), xy[None], u[None], SURE, box[None])
        assert np.degrees(stand.heading[0]) == pytest.approx(45, abs=3)


def test_who_shares_a_blob_or_stands_behind_another_is_partly_hidden():
    t = np.array([0.0, 0, 0, 0, 0, 1])
    box = np.array(
        [[100, 100, 50, 40], [140, 110, 50, 50], [300, 100, 50, 40], [352, 90, 9, 9], [0, 0, 9, 9], [140, 110, 50, 90]],
        float,
    )
    merged = np.arange(6) == 4
    assert partly_hidden(t, box, merged).tolist() == [True, False, False, True, True, False]
    assert partly_hidden(t[:0], box[:0], merged[:0]).shape == (0,)


def test_who_is_partly_hidden_has_larger_errors_and_the_size_of_the_track_so_far():
    prints = Footprints(GROUND, (WIDTH, HEIGHT), {"car": (3.0, 6.0), "short": (0.0, 3.0)})
    at = np.array([2.0, 25])
    xy, u, box = seen(CAR, at, 90)
    half = box - [0, 0, 0.3 * box[2], 0.2 * box[3]]  # another one hides the rest

    def place(box, hidden):
        one = np.array([7]), np.zeros(1), xy[None], u[None], SURE, box[None]
        return prints.place(*one, merged=np.array([hidden]))

    whole, part = place(box, False), place(half, True)
    assert (part.length, part.kind) == (pytest.approx(whole.length), ["car"])
    assert part.width == pytest.approx(whole.width, rel=0.1)
    error = part.xy[0] - at
    assert error @ np.linalg.inv(part.xy_own[0]) @ error < 5.99 < error @ np.linalg.inv(whole.xy_own[0]) @ error
    for _ in range(20):
        assert place(half, True).kind == ["car"]
    alone = Footprints(GROUND, (WIDTH, HEIGHT), {"short": (0.0, 3.0)}).place(
        np.array([8]), np.zeros(1), xy[None], u[None], SURE, half[None], np.array([True])
    )
    assert np.isnan(alone.length[0])
    assert alone.kind == [""]


def test_a_length_is_never_known_better_than_an_outline_tells_it():
    """From the side, and near, the edges alone would tell it to some centimetres."""
    stand = placed(seen(CAR, (0, 12), 90))
    assert 0.3 <= stand.length_sigma[0] < 0.5


def test_no_vehicle_at_all():
    stand = Footprints(GROUND, (WIDTH, HEIGHT)).place(
        np.empty(0, np.int64), np.empty(0), np.empty((0, 2)), np.empty((0, 2)), np.empty((0, 4, 4)), np.empty((0, 4))
    )
    assert stand.speed.shape == (0,)


@pytest.mark.skipif("VIDTRACK_DATA" not in os.environ, reason="needs the real data: set VIDTRACK_DATA")
def test_pedestrians_are_where_the_truth_has_them():
    """PETS 2009: columns 8 and 9 of the truth are metres. A calibration by a few rows must agree with the others."""
    path = Path(os.environ["VIDTRACK_DATA"]) / "pets09" / "gt.txt"
    table, metres = read_mot(path), np.loadtxt(path, delimiter=",")[:, 7:9]
    box = table.box - [1, 1, 0, 0]  # MOTChallenge counts pixels from 1
    feet = np.column_stack([box[:, 0] + (box[:, 2] - 1) / 2, box[:, 1] + box[:, 3] - 0.5])
    whole = (box[:, 0] > 2) & (box[:, 0] + box[:, 2] < 766) & (box[:, 1] + box[:, 3] < 574)
    feet, metres = feet[whole], metres[whole]
    some = np.arange(0, len(feet), len(feet) // 30)
    calibration = {"picture": feet[some].tolist(), "ground": metres[some].tolist()}
    size = {"name": "pets", "width": 768, "height": 576}
    ground = calibrated(Site.model_validate({"site": size, "calibration": calibration}))
    off = np.linalg.norm(ground.metres(ground.inside(feet)) - metres, axis=1)
    off = np.delete(off, some)
    assert np.isfinite(off).mean() > 0.8
    assert np.nanmedian(off) < 0.06
    assert np.nanpercentile(off, 95) < 0.2
    assert ground.pose().height_m == pytest.approx(7.1, abs=1)


def test_a_footprint_without_a_heading_has_no_length():
    _, _, box = seen(CAR, (0, 25), 0)
    _, sides = footprint(GROUND, box[None], np.full((1, 2), np.nan), 0.4)
    assert np.isnan(sides).all()


def test_speeds_follow_from_edges_where_the_tracker_lags():
    t = np.arange(40) / 25
    sights = [seen(CAR, (1.0, 44.0 - 15 * at), 180) for at in t]
    xy, u, box = (np.array(column) for column in zip(*sights, strict=True))
    edge = np.column_stack([box[:, :2], box[:, :2] + box[:, 2:]]) - 0.5
    P = np.repeat(np.diag([1.0, 1.0, 900.0, 900.0])[None], len(t), axis=0)
    road = Footprints(GROUND, (WIDTH, HEIGHT))
    stand = road.place(np.zeros(len(t), int), t, xy, 0.8 * u, P, box, edge=edge)
    assert stand.speed[-1] == pytest.approx(15, rel=0.03)
    assert placed((xy[-1], 0.8 * u[-1], box[-1])).speed[0] == pytest.approx(12, rel=0.05)
    assert stand.speed_own_sigma[-1] < 1.0
    assert (np.linalg.norm(stand.speed_by_shared, axis=1)[-10:] < 0.5).all()


def test_edges_that_the_border_may_cut_are_not_known():
    edge = np.array([[2.0, 5.0, 400.0, 300.0], [50.0, 60.0, WIDTH - 1.0, HEIGHT - 3.0]])
    assert np.isnan(uncut(edge, (WIDTH, HEIGHT))).tolist() == [[True, True, False, False], [False, False, True, True]]
