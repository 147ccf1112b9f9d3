"""Calibration: known cameras are found, errors have the covariance they are given, bad points are named."""

import logging
import re

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pinhole import POINTS, Pinhole, site_of

from vidtrack.errors import ConfigError
from vidtrack.traffic.calibration.account import examined
from vidtrack.traffic.calibration.calibrate import Check, calibrated, checked, doubts, road_plane, solved
from vidtrack.traffic.calibration.lens import Lens
from vidtrack.traffic.calibration.pairs import pairs_of

CAMERA = Pinhole()
LOOKED_AT = np.array([[0, 20.0], [-5, 16], [5, 40]])


def noisy(rng, px=1.0, m=0.02, **calibration):
    picture = CAMERA.picture(POINTS) + rng.normal(0, px, POINTS.shape)
    ground = POINTS + rng.normal(0, m, POINTS.shape)
    return site_of(picture, ground, sigma_picture_px=px, sigma_ground_m=m, **calibration)


def test_an_exact_camera_is_found():
    ground = calibrated(site_of(CAMERA.picture(POINTS), POINTS))
    seen = CAMERA.picture(LOOKED_AT)
    assert np.allclose(ground.metres(seen), LOOKED_AT, atol=1e-9)
    assert np.allclose(ground.pixels(LOOKED_AT), seen, atol=1e-8)
    pose = ground.pose()
    assert pose.focal_px == pytest.approx(CAMERA.focal)
    assert pose.height_m == pytest.approx(CAMERA.height)
    lifted = np.append(CAMERA.picture([[2, 30]])[0], 1) * ground.depth(np.array([[2, 30.0]])) + 1.5 * pose.up
    assert np.allclose(lifted[:2] / lifted[2], CAMERA.picture([[2, 30]], 1.5)[0], atol=1e-6)


@given(st.floats(4, 25), st.floats(12, 50), st.floats(600, 2000), st.floats(-np.pi, np.pi), st.floats(-1e6, 1e6))
@settings(max_examples=40, deadline=None)
def test_any_camera_is_found_whatever_the_axes_of_the_map(height, pitch, focal, turn, far):
    camera = Pinhole(height, pitch, focal)
    middle = height / np.tan(np.radians(pitch))
    spread = np.array([[-1, -1], [1, -1], [-1.2, 1], [1, 1.1], [0.2, 0.1]]) * 0.15 * height + [0, middle]
    cos, sin = np.cos(turn), np.sin(turn)
    onto_map = np.array([[cos, sin], [-sin, cos]])
    picture = camera.picture(spread)
    if not ((picture > 0) & (picture < [1280, 720])).all():
        return
    ground = calibrated(site_of(picture, spread @ onto_map + far))
    inner = spread * 0.5 + [0, 0.5 * middle]
    assert np.allclose(ground.metres(camera.picture(inner)), inner @ onto_map + far, atol=1e-4)
    assert ground.pose().height_m == pytest.approx(height, rel=1e-3)
    assert ground.inside(camera.picture(inner)).shape == (5, 2)
    assert np.isfinite(ground.inside(camera.picture(inner))).all()


def test_errors_have_the_covariance_that_is_given():
    """Over 400 calibrations the normalised squared error of positions is chi-square with two degrees of freedom."""
    rng = np.random.default_rng(1)
    seen, nees, chi2 = CAMERA.picture(LOOKED_AT), [], []
    for _ in range(400):
        site = noisy(rng)
        pairs = pairs_of(site)
        chi2.append(pairs.best()[1].chi2)
        with_noise = seen + rng.normal(0, 0.5, seen.shape)
        ground = _ground(site)
        at = ground.metres(with_noise)
        own, shared = ground.by_own_error(at), ground.by_shared_error(at)
        cov = 0.25 * own @ np.swapaxes(own, 1, 2) + shared @ np.swapaxes(shared, 1, 2)
        off = at - LOOKED_AT
        nees.append(np.einsum("ni,nij,nj->n", off, np.linalg.inv(cov), off))
    spread = 2.0 / np.sqrt(400)  # standard deviation of a mean of 400 chi-squares with two degrees
    assert np.abs(np.mean(nees, axis=0) - 2).max() < 4 * spread
    assert abs(np.mean(chi2) - 8) < 4 * np.sqrt(16 / 400)


def _ground(site):
    """The road plane with the standard deviations as they are given, whatever chance made of the points."""
    pairs = pairs_of(site)
    nothing = np.empty(0)
    agreed = Check(nothing, nothing, nothing, nothing, nothing, 0.0, 8, (), False, None)
    return road_plane(site, pairs, solved(pairs), agreed)


def test_two_vehicles_share_the_error_of_the_calibration():
    """The covariance between two positions is that of the shared errors."""
    rng = np.random.default_rng(2)
    seen = CAMERA.picture(LOOKED_AT[:2])
    found = np.array([_ground(noisy(rng)).metres(seen) for _ in range(500)])
    off = found - found.mean(axis=0)
    measured = np.einsum("si,sj->ij", off[:, 0], off[:, 1]) / len(off)
    first, second = calibrated(site_of(CAMERA.picture(POINTS), POINTS)).by_shared_error(LOOKED_AT[:2])
    given_cov = first @ second.T
    scale = np.sqrt(np.outer((off[:, 0] ** 2).mean(axis=0), (off[:, 1] ** 2).mean(axis=0)))
    assert np.abs(measured - given_cov).max() < 0.2 * scale.max()


def test_derivatives_are_those_of_the_map():
    ground = calibrated(site_of(CAMERA.picture(POINTS), POINTS, distortion=[-0.2, 0.05], focal_px=1000))
    seen = ground.pixels(LOOKED_AT)
    for axis, shift in enumerate(np.eye(2) * 1e-3):
        change = (ground.metres(seen + shift) - ground.metres(seen - shift)) / 2e-3
        assert np.allclose(ground.by_own_error(LOOKED_AT)[:, :, axis], change, atol=1e-5)
    shared = ground.by_shared_error(LOOKED_AT)
    for k, (above, below) in enumerate(ground.varied()):
        assert np.allclose(shared[:, :, k], (above.metres(seen) - below.metres(seen)) / 2, atol=1e-4)


def test_a_wrong_pair_is_named_and_the_others_are_not():
    rng = np.random.default_rng(3)
    for wrong in range(len(POINTS)):
        picture = CAMERA.picture(POINTS) + rng.normal(0, 1, POINTS.shape)
        picture[wrong] += [27, -21]
        site = site_of(picture, POINTS)
        pairs = pairs_of(site)
        check = checked(pairs, solved(pairs))
        assert check.wrong == (wrong,)
        assert check.contradiction
        assert f"pair {wrong + 1} of the calibration" in doubts(site, check)[0]


def test_good_pairs_are_rarely_blamed():
    rng = np.random.default_rng(4)
    blamed = 0
    for _ in range(60):
        pairs = pairs_of(noisy(rng))
        blamed += bool(checked(pairs, solved(pairs)).wrong)
    assert blamed <= 4  # one in a hundred by design


def test_five_pairs_can_disagree_but_none_can_be_named():
    picture = CAMERA.picture(POINTS[:5])
    picture[0] += [15, 15]
    site = site_of(picture, POINTS[:5])
    pairs = pairs_of(site)
    check = checked(pairs, solved(pairs))
    assert check.contradiction
    assert not check.wrong
    assert "too few to say which is wrong" in doubts(site, check)[0]
    assert np.isfinite(check.without_px).all()


def test_pairs_that_disagree_make_the_errors_larger():
    rng = np.random.default_rng(5)
    picture = CAMERA.picture(POINTS) + rng.normal(0, 6, POINTS.shape)
    modest, honest = (calibrated(site_of(picture, POINTS, sigma_picture_px=sigma)) for sigma in (1.0, 6.0))
    share = np.linalg.norm(modest.by_shared_error(LOOKED_AT)) / np.linalg.norm(honest.by_shared_error(LOOKED_AT))
    assert 0.6 < share < 1.7


def test_four_pairs_leave_nothing_to_check_with(caplog):
    with caplog.at_level(logging.WARNING):
        calibrated(site_of(CAMERA.picture(POINTS[:4]), POINTS[:4]))
    assert "4 pairs of points leave nothing to check the calibration with" in caplog.text
    report = examined(site_of(CAMERA.picture(POINTS[:4]), POINTS[:4])).report
    assert report["degrees_of_freedom"] == 0
    assert all(pair["without_px"] is None for pair in report["pairs"])


def test_outside_the_hull_there_is_no_answer():
    ground = calibrated(site_of(CAMERA.picture(POINTS), POINTS))
    outside = np.array([[20.0, 700], [1270, 30], [640, 30], [-50, 300]])
    assert np.isnan(ground.inside(outside)).all()
    corners = CAMERA.picture(POINTS)
    assert np.isfinite(ground.inside(corners)).all()


LINE = np.array([[0, 12], [0, 15], [0, 20], [0, 30], [5, 20.0]])
BAD = {
    "mirrored": (POINTS, POINTS * [1, -1], "the points are mirrored"),
    "swapped axes": (POINTS, POINTS[:, ::-1], "the points are mirrored"),
    "out of order": (POINTS[:4], POINTS[[0, 1, 3, 2]], "no camera sees all these points"),
    "three of four on a line": (
        LINE[[0, 1, 2, 4]],
        LINE[[0, 1, 2, 4]],
        "points 1, 2, 3 of the 4 in picture lie on one",
    ),
    "all but one on a line": (LINE, LINE, "points 1, 2, 3, 4 of the 5 in picture lie on one line"),
    "all on a line of the ground": (POINTS, POINTS * [1e-4, 1], "of the 8 in ground lie on one line"),
    "three of four on a line of the ground": (
        POINTS[:4],
        [[0, 0], [5, 0], [10, 0], [5, 9]],
        "points 1, 2, 3 of the 4 in ground lie on one line",
    ),
}


@pytest.mark.parametrize(("seen", "ground", "words"), BAD.values(), ids=BAD)
def test_impossible_points_are_refused_in_one_line(seen, ground, words):
    with pytest.raises(ConfigError, match=words) as refused:
        calibrated(site_of(CAMERA.picture(seen), ground))
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("k", [(0.0, 0.0), (-0.3, 0.1), (0.1, 0.0), (-0.25, 0.0)])
def test_a_lens_is_undone(k):
    lens = Lens(*k, 1000.0, (639.5, 359.5))
    straight = np.random.default_rng(0).uniform([0, 0], [1280, 720], (200, 2))
    assert np.allclose(lens.straight(lens.bent(straight)), straight, atol=1e-6)
    assert np.isfinite(lens.straight(np.array([[639.5, 359.5]]))).all()


def test_beyond_the_fold_of_a_lens_there_is_no_answer():
    assert np.isnan(Lens(-0.5, 0.0, 300.0, (0.0, 0.0)).straight(np.array([[900.0, 0]]))).all()


def test_a_camera_with_a_lens_is_calibrated():
    lens = Lens(-0.2, 0.05, 1000.0, (639.5, 359.5))
    calibration = {"distortion": [-0.2, 0.05], "focal_px": 1000}
    ground = calibrated(site_of(lens.bent(CAMERA.picture(POINTS)), POINTS, **calibration))
    assert np.allclose(ground.metres(lens.bent(CAMERA.picture(LOOKED_AT))), LOOKED_AT, atol=1e-6)


def test_longitude_and_latitude():
    """One minute of latitude is a nautical mile; the points become metres of the system that is named."""
    pytest.importorskip("pyproj")
    lon, lat = 9.0, 51.0  # on the central meridian of EPSG:25832
    metres_per_degree = np.array([70197.0, 111240.0])  # of WGS 84 at 51 degrees north
    degrees = np.array([lon, lat]) + POINTS / metres_per_degree
    ground = calibrated(site_of(CAMERA.picture(POINTS), degrees, geographic=True, epsg=25832, sigma_ground_m=0.1))
    at = ground.metres(CAMERA.picture(LOOKED_AT))
    assert np.allclose(at[:, 0] - 500000, LOOKED_AT[:, 0], atol=0.1)
    assert np.allclose(np.diff(at[:, 1]), np.diff(LOOKED_AT[:, 1]), rtol=2e-3)


def test_the_account_tells_near_from_far_and_a_wrong_height():
    rng = np.random.default_rng(6)
    report = examined(noisy(rng, camera_height_m=8.0)).report
    near, _, far = report["places"]
    assert near["m_per_px_away"] < 0.3 * far["m_per_px_away"]
    at = np.array(far["ground_m"])
    J = np.column_stack([(CAMERA.picture(at + d) - CAMERA.picture(at - d))[0] / 0.2 for d in 0.1 * np.eye(2)])
    worth = 1 / np.linalg.svd(J, compute_uv=False)
    assert [far["m_per_px_across"], far["m_per_px_away"]] == pytest.approx(worth, rel=0.1)
    assert 0 < near["speed_sigma_percent"] < 5
    assert report["camera"]["height_m"] == pytest.approx(8, abs=4 * report["camera"]["height_sigma_m"])
    assert not report["warnings"]
    assert not report["contradiction"]
    wrong = examined(noisy(rng, camera_height_m=26.2)).report
    (warning,) = wrong["warnings"]
    assert "camera_height_m = 26.2, but the points put the camera" in warning
    sigma = re.search(r"standard deviation 0\.0*(\d+) m", warning)
    assert len(sigma[1]) == 2  # digits
    assert wrong["contradiction"]


@pytest.mark.parametrize("turn", np.linspace(0, 6, 13))
def test_a_camera_that_looks_straight_down_has_no_focal_length(turn):
    """Whatever rounding leaves of a perspective."""
    cos, sin = np.cos(turn), np.sin(turn)
    picture = POINTS @ np.array([[cos, sin], [sin, -cos]]) * 7.0 + [640, 360]
    assert calibrated(site_of(picture - picture.min(axis=0), POINTS)).pose() is None
