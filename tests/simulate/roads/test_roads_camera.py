"""The camera: where points of the road are in the picture, and back."""

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.simulate.roads.pinhole import pinhole

SIZE = (1280, 720)


def camera(k1=0.0, height=8.0, tilt_deg=18.0, azimuth_deg=40.0):
    return pinhole((2.0, -1.0), np.radians(azimuth_deg), np.radians(tilt_deg), height, SIZE, np.radians(60), k1)


def on_road(xy):
    return np.column_stack([xy, np.zeros(len(xy))])


@given(
    k1=st.floats(-0.25, 0.3),
    height=st.floats(5, 50),
    tilt=st.floats(20, 80),
    azimuth=st.floats(-180, 180),
    x=st.floats(0, 1280),
    y=st.floats(0, 720),
)
def test_from_the_picture_to_the_road_and_back(k1, height, tilt, azimuth, x, y):
    eye = camera(k1, height, tilt, azimuth)
    ground = eye.on_ground(np.array([[x, y]]))
    if np.isnan(ground).any() or np.abs(ground).max() > 1e4:
        return
    xy, depth = eye.project(on_road(ground))
    assert xy[0] == pytest.approx([x, y], abs=1e-4)
    assert depth[0] > 0


@pytest.mark.parametrize("k1", [0.0, -0.2, 0.15])
def test_the_picture_is_opencvs(k1):
    eye = camera(k1)
    rng = np.random.default_rng(1)
    points = np.column_stack([rng.uniform(-5, 40, 50), rng.uniform(-5, 30, 50), rng.uniform(0, 4, 50)])
    matrix = np.array([[eye.focal, 0, eye.centre[0]], [0, eye.focal, eye.centre[1]], [0, 0, 1]])
    turn = cv2.Rodrigues(eye.axes)[0]
    theirs = cv2.projectPoints(points, turn, -eye.axes @ eye.position, matrix, np.array([k1, 0, 0, 0.0]))[0][:, 0]
    ours, depth = eye.project(points)
    seen = (depth > 0) & (np.abs(ours - eye.centre) < SIZE).all(axis=1)
    assert seen.sum() > 20
    assert ours[seen] == pytest.approx(theirs[seen], abs=1e-6)


def test_the_axis_meets_the_road_in_its_aim_and_the_horizon_is_where_it_must_be():
    eye = camera(tilt_deg=12.0)
    assert eye.on_ground(eye.centre[None])[0] == pytest.approx([2.0, -1.0])
    horizon = eye.centre[1] - eye.focal * np.tan(np.radians(12.0))
    assert np.isnan(eye.on_ground(np.array([[640.0, horizon - 0.1]]))).all()
    assert np.isfinite(eye.on_ground(np.array([[640.0, horizon + 0.1]]))).all()


def test_what_lies_far_outside_a_barrel_lens_stays_outside_the_picture():
    eye = camera(k1=-0.3)
    aside = eye.position + 5 * eye.axes[2] + np.linspace(3.5, 100, 50)[:, None] * eye.axes[0]
    xy, depth = eye.project(aside)
    assert (depth > 0).all()
    assert (xy[:, 0] > SIZE[0]).all()
