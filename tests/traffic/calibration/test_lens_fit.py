"""A lens by the points of a calibration: it is found with the error that is given, and told from a wrong pair."""

import numpy as np
import pytest
from pinhole import POINTS, Pinhole, site_of

from vidtrack.traffic.calibration.account import examined
from vidtrack.traffic.calibration.calibrate import calibrated, checked, doubts, solved
from vidtrack.traffic.calibration.lens import Lens
from vidtrack.traffic.calibration.pairs import pairs_of

CAMERA = Pinhole()
LOOKED_AT = np.array([[0, 20.0], [-5, 16], [5, 40]])
K1 = -0.25


def seen_through(k1, rng=None, **calibration):
    """The camera's points through a lens, with 1 px and 2 cm of noise where there is a generator."""
    picture, ground = Lens(k1, 0, CAMERA.focal, (639.5, 359.5)).bent(CAMERA.picture(POINTS)), POINTS
    if rng is not None:
        picture = picture + rng.normal(0, 1, POINTS.shape)
        ground = ground + rng.normal(0, 0.02, POINTS.shape)
    return site_of(picture, ground, sigma_picture_px=1.0, sigma_ground_m=0.02, **calibration)


def test_an_exact_lens_is_found():
    ground = calibrated(seen_through(K1, distortion="fit"))
    lens = Lens(K1, 0, CAMERA.focal, (639.5, 359.5))
    assert np.allclose(ground.metres(lens.bent(CAMERA.picture(LOOKED_AT))), LOOKED_AT, atol=1e-5)
    assert ground.pose().focal_px == pytest.approx(CAMERA.focal, rel=1e-4)
    told = examined(seen_through(K1, distortion="fit")).report["lens"]
    assert told["k1"] == pytest.approx(K1, rel=1e-4)  # in focal lengths of the camera, which nobody stated
    assert told["focal_px"] == pytest.approx(CAMERA.focal, rel=1e-4)
    assert told["corner_px"] == pytest.approx(
        K1 * (np.hypot(639.5, 359.5) / CAMERA.focal) ** 3 * CAMERA.focal, rel=1e-3
    )


def test_the_lens_and_positions_have_the_errors_that_are_given():
    """Over 200 calibrations the normalised squared errors are chi-square."""
    rng, lens, nees = np.random.default_rng(0), Lens(K1, 0, CAMERA.focal, (639.5, 359.5)), []
    looked_at = lens.bent(CAMERA.picture(LOOKED_AT))
    for _ in range(200):
        site = seen_through(K1, rng, distortion="fit", focal_px=CAMERA.focal)
        pairs = pairs_of(site)
        fit = solved(pairs)
        by_lens = (pairs.lens.k1 - K1) ** 2 / fit.cov[8, 8]
        ground = calibrated(site)
        shared, off = ground.by_shared_error(LOOKED_AT), ground.metres(looked_at) - LOOKED_AT
        by_place = np.einsum("ni,nij,nj->n", off, np.linalg.inv(shared @ np.swapaxes(shared, 1, 2)), off)
        nees.append([by_lens, fit.chi2 / pairs_spare(pairs), *by_place / 2])
    mean = np.mean(nees, axis=0)
    assert abs(mean[0] - 1) < 4 * np.sqrt(2 / 200)
    assert abs(mean[1] - 1) < 4 * np.sqrt(2 / 7 / 200)
    assert np.abs(mean[2:] - 1).max() < 4 * np.sqrt(1 / 200)


def pairs_spare(pairs):
    return 2 * len(pairs.X) - 9


def test_derivatives_with_a_fitted_lens_are_those_of_the_map():
    ground = calibrated(seen_through(K1, np.random.default_rng(1), distortion="fit"))
    seen, shared = ground.pixels(LOOKED_AT), ground.by_shared_error(LOOKED_AT)
    assert shared.shape == (3, 2, 9)
    for k, (above, below) in enumerate(ground.varied()):
        assert np.allclose(shared[:, :, k], (above.metres(seen) - below.metres(seen)) / 2, atol=2e-3)


def test_a_lens_that_nobody_stated_is_told_and_no_pair_is_blamed():
    rng, told = np.random.default_rng(2), 0
    for _ in range(20):
        site = seen_through(-0.3, rng)
        pairs = pairs_of(site)
        check = checked(pairs, solved(pairs))
        told += check.lens is not None and check.contradiction and not check.wrong
        if check.lens is not None:
            (said,) = doubts(site, check)
            assert 'write distortion = "fit" into [calibration]' in said
    assert told >= 19


def test_a_wrong_pair_is_not_taken_for_a_lens():
    rng = np.random.default_rng(3)
    for wrong in range(len(POINTS)):
        picture = CAMERA.picture(POINTS) + rng.normal(0, 1, POINTS.shape)
        picture[wrong] += [27, -21]
        pairs = pairs_of(site_of(picture, POINTS))
        check = checked(pairs, solved(pairs))
        assert check.wrong == (wrong,)
        assert check.lens is None


def test_a_wrong_pair_is_named_where_the_lens_is_fitted():
    picture = Lens(K1, 0, CAMERA.focal, (639.5, 359.5)).bent(CAMERA.picture(POINTS))
    picture[2] += [27, -21]
    pairs = pairs_of(site_of(picture, POINTS, distortion="fit"))
    assert checked(pairs, solved(pairs)).wrong == (2,)


@pytest.mark.parametrize("distortion", [None, "fit"])
def test_the_account_has_the_homography_and_its_covariance(distortion):
    """The matrix is the map; its covariance is that of the maps of 400 calibrations."""
    rng, found = np.random.default_rng(4), []
    for _ in range(400):
        told = examined(seen_through(0.0, rng, distortion=distortion)).report["homography"]
        moved = np.eye(3)
        moved[:2, 2] = -np.array(told["origin_m"])
        matrix = np.array(told["matrix"]) @ moved
        found.append(matrix.ravel()[:8] / matrix[2, 2])
    ground = calibrated(seen_through(0.0, distortion=distortion))
    there = np.column_stack([LOOKED_AT - ground.plane.origin, np.ones(3)]) @ ground.about_origin.T
    assert np.allclose(there[:, :2] / there[:, 2:], ground.pixels(LOOKED_AT), atol=1e-6)
    back = np.eye(3)
    back[:2, 2] = -ground.plane.origin
    steps = np.concatenate([np.eye(8), np.zeros((8, 1))], axis=1) * 1e-6

    def whole(step):
        matrix = (ground.about_origin + step.reshape(3, 3)) @ back
        return matrix.ravel()[:8] / matrix[2, 2]

    J = np.stack([(whole(step) - whole(-step)) / 2e-6 for step in steps], axis=1)
    given = J @ ground.homography_cov[:8, :8] @ J.T
    assert np.sqrt(np.diag(given)) == pytest.approx(np.std(found, axis=0), rel=0.15)
