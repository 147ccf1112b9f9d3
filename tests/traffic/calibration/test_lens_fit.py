"""A lens by the points of a calibration: it is found with the error that is given, and told from a wrong pair."""

import json
from itertools import combinations

import numpy as np
import pytest
from pinhole import POINTS, Pinhole, site_of

from vidtrack.errors import ConfigError
from vidtrack.traffic.calibration.account import examined
from vidtrack.traffic.calibration.calibrate import Check, calibrated, checked, doubts, road_plane, solved
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


def plane_of(site):
    """The road plane with the standard deviations as they are given, whatever chance made of the points."""
    pairs, nothing = pairs_of(site), np.empty(0)
    return road_plane(site, pairs, solved(pairs), Check(*[nothing] * 5, 0.0, 7, (), False, None))


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
    """Over 60 calibrations the normalised squared errors are chi-square."""
    rng, lens, nees = np.random.default_rng(0), Lens(K1, 0, CAMERA.focal, (639.5, 359.5)), []
    looked_at = lens.bent(CAMERA.picture(LOOKED_AT))
    for _ in range(60):
        site = seen_through(K1, rng, distortion="fit", focal_px=CAMERA.focal)
        pairs = pairs_of(site)
        fit = solved(pairs)
        by_lens = (pairs.lens.k1 - K1) ** 2 / fit.cov[8, 8]
        ground = plane_of(site)
        shared, off = ground.by_shared_error(LOOKED_AT), ground.metres(looked_at) - LOOKED_AT
        by_place = np.einsum("ni,nij,nj->n", off, np.linalg.inv(shared @ np.swapaxes(shared, 1, 2)), off)
        nees.append([by_lens, fit.chi2 / (2 * len(POINTS) - 9), *by_place / 2])
    mean = np.mean(nees, axis=0)
    assert abs(mean[0] - 1) < 4 * np.sqrt(2 / 60)
    assert abs(mean[1] - 1) < 4 * np.sqrt(2 / 7 / 60)
    assert np.abs(mean[2:] - 1).max() < 4 * np.sqrt(1 / 60)


def test_derivatives_with_a_fitted_lens_are_those_of_the_map():
    ground = calibrated(seen_through(K1, np.random.default_rng(1), distortion="fit"))
    seen, shared = ground.pixels(LOOKED_AT), ground.by_shared_error(LOOKED_AT)
    assert shared.shape == (3, 2, 9)
    for k, (above, below) in enumerate(ground.varied()):
        assert np.allclose(shared[:, :, k], (above.metres(seen) - below.metres(seen)) / 2, rtol=0.02, atol=2e-3)


def test_a_lens_that_nobody_stated_is_told_and_no_pair_is_blamed():
    rng, told = np.random.default_rng(2), 0
    for _ in range(8):
        site = seen_through(-0.3, rng)
        pairs = pairs_of(site)
        check = checked(pairs, solved(pairs))
        told += check.lens is not None and check.contradiction and not check.wrong
        if check.lens is not None:
            (said,) = doubts(site, check)
            assert 'write distortion = "fit" into [calibration]' in said
    assert told >= 7


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
def test_the_homography_has_the_covariance_that_is_given(distortion):
    """The matrix is the map; its covariance is that of the maps of 60 calibrations; the account has both."""
    rng, found = np.random.default_rng(4), []
    for _ in range(60):
        matrix = plane_of(seen_through(0.0, rng, distortion=distortion)).homography
        found.append(matrix.ravel()[:8] / matrix[2, 2])
    exact = seen_through(0.0, distortion=distortion)
    ground, told = plane_of(exact), examined(exact).report["homography"]
    assert told["matrix"] == ground.about_origin.tolist()
    assert told["covariance"] == ground.homography_cov.tolist()
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
    assert np.sqrt(np.diag(given)) == pytest.approx(np.std(found, axis=0), rel=0.35)


@pytest.mark.parametrize("distortion", [None, "fit"])
def test_two_pairs_that_are_exchanged_are_named_or_refused(distortion):
    """They are among the named ones, or the calibration is refused."""
    shown, named = seen_through(0.0).calibration.picture, 0
    for i, j in list(combinations(range(len(POINTS)), 2))[::7]:
        picture = np.array(shown)
        picture[[i, j]] = picture[[j, i]]
        site = site_of(picture, POINTS, distortion=distortion)
        try:
            report = examined(site).report
        except ConfigError:
            continue
        assert report["contradiction"]
        assert json.dumps(report, allow_nan=False)
        named += {i + 1, j + 1} <= set(report["wrong"])
    assert named > 0


def test_a_lens_that_would_fold_the_picture_back_is_refused():
    picture = Lens(K1, 0, CAMERA.focal, (639.5, 359.5)).bent(CAMERA.picture(POINTS))
    picture[[0, 4]] = picture[[4, 0]]
    with pytest.raises(ConfigError, match="folds the picture back inside them: some are wrong"):
        calibrated(site_of(picture, POINTS, distortion="fit"))
