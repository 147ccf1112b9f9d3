"""Blobs of a calibrated camera as measurements in metres."""

from dataclasses import replace

import numpy as np
import pytest
from pinhole import HEIGHT, POINTS, WIDTH, Pinhole, site_of

import vidtrack as vt
from vidtrack.estimate.noise import LASTING_S
from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.road_scans import LAMP_M, LAMP_S, InPicture, RoadScans

CAMERA = Pinhole()
PLACES = np.array([[0.0, 20.0], [-2.0, 30.0], [3.0, 40.0]])
HEADING = np.radians([10.0, 190.0, 0.0])
NOBODY = np.empty((0, 2))


@pytest.fixture(scope="module")
def ground():
    return calibrated(site_of(CAMERA.picture(POINTS), POINTS))


def blobs_and_tracks():
    """A scan of the vehicles' blobs, and tracks in pixels that have taken them one by one."""
    seen = [CAMERA.vehicle(xy, h, 4.4, 1.8, 1.5) for xy, h in zip(PLACES, HEADING, strict=True)]
    z, box = (np.array(part) for part in zip(*seen, strict=True))
    relative = np.hstack([box[:, :2] - z, box[:, 2:]])
    tracker = vt.Tracker(vt.ConstantVelocity(speed=200.0), picture=vt.Picture((WIDTH, HEIGHT)))
    ahead = PLACES + 8.0 * np.column_stack([np.sin(HEADING), np.cos(HEADING)])
    u = CAMERA.picture(ahead) - CAMERA.picture(PLACES)
    x = np.column_stack([z[:, 0], u[:, 0], z[:, 1], u[:, 1]])
    tracker.add(0.0, x, np.tile(np.eye(4), (3, 1, 1)), box=relative)
    blobs = vt.Scan(0.0, z, np.eye(2), box=relative)
    return blobs, tracker.step(blobs)


def test_a_blob_is_where_its_vehicle_stands(ground):
    blobs, tracks = blobs_and_tracks()
    scan = RoadScans(ground, (WIDTH, HEIGHT)).scan(blobs, tracks, PLACES, station=3)
    assert scan.station == 3
    assert len(scan) == 3
    off = scan.z - PLACES
    d2 = np.einsum("ni,nij,nj->n", off, np.linalg.inv(scan.R), off)
    assert (d2 < 9).all()
    assert np.linalg.norm(off, axis=1).max() < 1.0
    assert (np.linalg.eigvalsh(scan.R - scan.lasting) > 0).all()


def test_what_lamps_light_is_off_its_vehicle_for_a_while(ground):
    blobs, tracks = blobs_and_tracks()
    roads = RoadScans(ground, (WIDTH, HEIGHT))
    day, night = (roads.scan(blobs, tracks, NOBODY, 0, dark=dark) for dark in (False, True))
    np.testing.assert_array_equal(night.z, day.z)
    lamps = np.broadcast_to(LAMP_M**2 * np.eye(2), (3, 2, 2))
    np.testing.assert_allclose(night.R - day.R, lamps)
    np.testing.assert_allclose(night.lasting - day.lasting, LAMP_S / LASTING_S * lamps)


def test_a_blob_that_two_tracks_share_is_left_out(ground):
    blobs, tracks = blobs_and_tracks()
    group, measurement = np.array([0, 0, -1]), tracks.measurement.copy()
    measurement[:2] = measurement[0]
    shared = replace(tracks, group=group, measurement=measurement)
    scan = RoadScans(ground, (WIDTH, HEIGHT)).scan(blobs, shared, NOBODY, 0)
    assert len(scan) == 2  # that of the third track, and the one that is nobody's


def test_a_blob_in_which_two_vehicles_are_known_is_left_out(ground):
    blobs, tracks = blobs_and_tracks()
    roads = RoadScans(ground, (WIDTH, HEIGHT))
    alone = roads.scan(blobs, tracks, PLACES, 0)
    behind, beside = PLACES[0] + [0.0, 3.0], PLACES[0] + [6.0, 0.0]
    np.testing.assert_array_equal(roads.scan(blobs, tracks, np.vstack([PLACES, behind]), 0).z, alone.z[1:])
    np.testing.assert_array_equal(roads.scan(blobs, tracks, np.vstack([PLACES, beside]), 0).z, alone.z)


def test_the_picture_covers_the_calibrated_road_in_it(ground):
    covered = InPicture(ground, (WIDTH, HEIGHT))
    xy = np.array([[0.0, 20.0], [0.0, 200.0], [0.0, -20.0], [40.0, 20.0]])
    np.testing.assert_array_equal(covered.share(xy), [1, 0, 0, 0])
    hull_m2 = (12 + 16) / 2 * 13 + (16 + 24) / 2 * 23  # of the points, a trapezium upon a trapezium
    assert covered.area() == pytest.approx(hull_m2, rel=0.1)
