"""Speeds, sizes and classes of whole tracks."""

import numpy as np
import pytest
from driven import BIKE, CAMERA, CAR, GROUND, LORRY, VAN, WALKER, arc, edges_of, straight
from pinhole import POINTS, site_of

from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.lengths import UNKNOWN
from vidtrack.traffic.vehicles.classes import named, named_by_length
from vidtrack.traffic.vehicles.vehicles import Vehicles

DRIVES = {
    "away": straight((1.5, 15.0), 0.02, 12.0, 2.4),
    "towards": straight((-2.0, 46.0), np.pi - 0.1, 14.0, 2.2),
    "across": straight((-8.0, 26.0), 1.4, 9.0, 1.9),
    "turning": arc((0.0, 26.0), 10.0, 6.0, 3.0, -1.0),
}


def fitted(parts, at, track=0, noise=0.0, seed=0):
    """Speeds of one track at times `at`, and its classes; parts: (t, xy, heading, size) one after the other."""
    rng, vehicles = np.random.default_rng(seed), Vehicles(GROUND)
    t, xy = (np.concatenate([part[k] for part in parts]) for k in (0, 1))
    edge = np.concatenate([edges_of(part[1], part[2], part[3]) for part in parts])
    edge += noise * rng.standard_normal(edge.shape)
    vehicles.add(np.full(len(t), track), t, xy, edge)
    found = vehicles.fitted(np.arange(track + 1), np.full(len(at), track), np.asarray(at, float))
    return found.speeds, found.classes


@pytest.mark.parametrize("name", DRIVES)
def test_speed_and_size_of_exact_boxes(name):
    t, xy, heading = DRIVES[name]
    speed = np.linalg.norm(xy[1] - xy[0]) * 25
    speeds, classes = fitted([(t, xy, heading, CAR)], [t.mean()])
    assert speeds.speed[0] == pytest.approx(speed, rel=0.02)
    assert classes.size[0] == pytest.approx(CAR, abs=0.5)
    assert named(classes)[0] == ["car"]


def test_the_stated_error_is_the_true_one():
    t, xy, heading = DRIVES["towards"]
    off = []
    for seed in range(40):
        speeds, _ = fitted([(t, xy, heading, CAR)], [t.mean()], noise=1.5, seed=seed)
        off.append((speeds.speed[0] - 14.0) / speeds.own[0])
    assert 0.5 < np.std(off) < 1.4
    assert abs(np.mean(off)) < 0.5


def test_a_speed_is_less_sure_where_the_path_bends():
    """Something else draws the edges along for the last 0.6 s, by 0.8 m, as where another vehicle comes near."""
    t, xy, heading = DRIVES["towards"]
    ahead = np.array([np.sin(heading[0]), np.cos(heading[0])])
    drawn = xy + 0.8 * np.clip((t - t[-1]) / 0.6 + 1, 0, 1)[:, None] ** 2 * ahead
    at = [t[-1] - 0.2]
    calm, _ = fitted([(t, xy, heading, CAR)], at)
    bent, _ = fitted([(t, drawn, heading, CAR)], at)
    assert bent.speed[0] - 14.0 > 5 * calm.own[0]
    assert bent.own[0] > 2 * calm.own[0]


def test_the_calibration_s_error_is_kept_apart_and_grows_with_its_covariance():
    t, xy, heading = DRIVES["away"]
    speeds, _ = fitted([(t, xy, heading, CAR)], [t.mean()])
    assert 0 < speeds.shared[0] < 0.05 * 12.0


def test_classes_by_size_and_speed():
    for size, speed, name in (
        (BIKE, 10.0, "motorcycle or bicycle"),
        (CAR, 12.0, "car"),
        (VAN, 12.0, "van"),
        (LORRY, 10.0, "lorry or bus"),
        (WALKER, 1.4, "person"),
    ):
        t, xy, heading = straight((-3.0, 22.0), 1.0, speed, 8.0 / speed)
        _, classes = fitted([(t, xy, heading, size)], [t.mean()], noise=0.5)
        names, probability = named(classes)
        assert names == [name]
        assert probability[0] > 0.8


def test_a_site_s_bounds_of_length_come_first():
    t, xy, heading = DRIVES["across"]
    _, classes = fitted([(t, xy, heading, CAR)], [t.mean()])
    length = classes.size[:, 0], classes.sigma[:, 0]
    names, probability = named_by_length(*length, {"small": (0.0, 3.0), "large": (3.0, 9.0)})
    assert names == ["large"]
    assert probability[0] > 0.9
    assert named_by_length(*length, {"small": (0.0, 3.0)})[0] == [UNKNOWN]


def test_a_track_that_goes_over_to_another_vehicle_has_the_speeds_of_both():
    t, xy, heading = DRIVES["away"]
    later = straight(xy[-1] + [-3.5, 0.0], np.pi, 8.0, 2.0)
    parts = [(t, xy, heading, CAR), (later[0] + t[-1] + 0.04, *later[1:], CAR)]
    speeds, _ = fitted(parts, [1.2, t[-1] + 1.0])
    assert speeds.speed == pytest.approx([12.0, 8.0], rel=0.03)


def traffic(ground):
    """A dozen cars and vans that drive through the pictures of CAMERA, on another ground."""
    vehicles, (t, xy, heading) = Vehicles(ground), DRIVES["across"]
    for track in range(14):
        size = np.array(VAN if track % 5 == 4 else CAR) * (1 + 0.01 * (track % 3 - 1))
        edge = edges_of(xy + np.array([0.0, 0.3 * track]), heading, size)
        vehicles.add(np.full(len(t), track), t + 3.0 * track, ground.metres(edge[:, [0, 3]]), edge)
    return vehicles.fitted(np.arange(14), np.zeros(0, int), np.zeros(0))


@pytest.mark.parametrize("factor", [0.8, 1.0, 1.3, 3.28])
def test_sizes_of_the_traffic_tell_a_wrong_scale(factor):
    ground = calibrated(site_of(CAMERA.picture(POINTS), POINTS * factor, sigma_picture_px=0.5))
    scale = traffic(ground).scale
    assert scale.vehicles == 14
    assert scale.factor == pytest.approx(factor, rel=0.1)
    assert scale.off == (factor != 1.0)


def test_a_few_vehicles_say_nothing_about_the_scale():
    t, xy, heading = DRIVES["away"]
    vehicles = Vehicles(GROUND)
    vehicles.add(np.zeros(len(t), int), t, xy, edges_of(xy, heading, CAR))
    assert vehicles.fitted(np.arange(1), np.zeros(0, int), np.zeros(0)).scale is None


def test_nothing_is_said_of_boxes_that_are_of_no_vehicle_or_too_few_or_outside_the_points():
    t, xy, heading = DRIVES["away"]
    speeds, classes = fitted([(t, xy, heading, CAR)], [t.mean()], noise=60.0)
    assert np.isnan(speeds.speed).all()
    assert named(classes)[0] == [UNKNOWN]
    assert np.isnan(fitted([(t[:8], xy[:8], heading[:8], CAR)], [t[4]])[0].speed).all()
    assert np.isnan(fitted([(t, xy + np.array([30.0, 0.0]), heading, CAR)], [t.mean()])[0].speed).all()
    assert np.isnan(fitted([(t, xy, heading, CAR)], [t[-1] + 1.0])[0].speed).all()


def test_nothing_without_edges_or_without_a_calibration():
    assert Vehicles(GROUND).fitted(np.arange(1), np.zeros(1, int), np.zeros(1)) is None
    assert Vehicles(None).fitted(np.arange(1), np.zeros(1, int), np.zeros(1)) is None
