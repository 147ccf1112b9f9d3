"""Calibration by a straight road: known cameras are found from segments, with the covariance that is given."""

import numpy as np
import pytest
from pinhole import HEIGHT, WIDTH

from vidtrack.errors import ConfigError
from vidtrack.traffic.calibration.account import examined
from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.calibration.straight_road import homography, straight_road
from vidtrack.traffic.site import Site

TRUE = np.array([np.radians(18), np.radians(-14), np.radians(1.5), np.log(1100.0), np.log(7.5)])
"""pitch, yaw, roll, log focal length, log height"""
CENTER = np.array([(WIDTH - 1) / 2, (HEIGHT - 1) / 2])
ALONG = [((-3, 16), (-3, 40)), ((0, 15), (0, 45)), ((3.5, 20), (3.5, 50))]
ACROSS = [((-3, 18), (3.5, 18)), ((-3, 30), (3.5, 30)), ((-3, 42), (3.5, 42))]
LENGTHS = [((-3, 16), (-3, 28)), ((0, 33), (0, 45)), ((-3, 18), (3.5, 18))]
LOOKED_AT = np.array([[0, 20.0], [2, 35], [-2, 25]])


def picture(xy, theta=TRUE):
    p = np.column_stack([np.reshape(xy, (-1, 2)), np.ones(np.size(xy) // 2)]) @ homography(theta).T
    return p[:, :2] / p[:, 2:] + CENTER


def site_of(theta=TRUE, noise=0.0, rng=None, along=ALONG, across=ACROSS, lengths=LENGTHS, **more):
    def seen(segment):
        ends = picture(segment, theta)
        return (ends if rng is None else ends + rng.normal(0, noise, (2, 2))).tolist()

    calibration = {
        "directions": [seen(one) for one in along],
        "across": [seen(one) for one in across],
        "lengths": [[*seen(one), float(np.linalg.norm(np.subtract(*one)))] for one in lengths],
        "sigma_picture_px": noise or 1.0,
        "sigma_ground_m": 0.001,
    }
    camera = {"name": "road", "width": WIDTH, "height": HEIGHT}
    return Site.model_validate({"site": camera, "calibration": calibration | more})


def distances(ground, theta=TRUE):
    """(3,) m; between the places that are looked at: the axes of the road are free to shift."""
    road = ground.metres(picture(LOOKED_AT, theta))
    return np.linalg.norm(road - np.roll(road, 1, axis=0), axis=1)


EXACT = np.linalg.norm(LOOKED_AT - np.roll(LOOKED_AT, 1, axis=0), axis=1)


def test_an_exact_camera_is_found():
    fit = straight_road(site_of())
    assert fit.chi2 < 1e-6
    assert fit.spare == 9 - 5
    assert np.allclose(fit.ground.metres(picture(LOOKED_AT)), LOOKED_AT, atol=1e-3)
    pose = fit.ground.pose()
    assert pose.focal_px == pytest.approx(1100, rel=1e-3)
    assert pose.height_m == pytest.approx(7.5, rel=1e-3)


def test_a_level_camera_of_known_focal_length_needs_nothing_across():
    level = np.where(np.arange(5) == 2, 0.0, TRUE)
    site = site_of(level, across=[], along=ALONG[:2], lengths=LENGTHS[:1], focal_px=1100)
    fit = straight_road(site)
    assert fit.spare == 0
    assert "leave nothing to check" in fit.doubts()[0]
    assert np.allclose(fit.ground.metres(picture(LOOKED_AT, level)), LOOKED_AT, atol=1e-3)


def test_errors_have_the_covariance_that_is_given():
    """Distances vary over many noisy pictures as the shared error says."""
    rng = np.random.default_rng(0)
    found, said, chi2 = [], [], []
    for _ in range(25):
        fit = straight_road(site_of(noise=0.5, rng=rng))
        found.append(distances(fit.ground))
        said.append([(distances(a) - distances(b)) / 2 for a, b in fit.ground.varied()])
        chi2.append(fit.chi2)
    share = np.std(found, axis=0) / np.linalg.norm(said, axis=1).mean(axis=0)
    assert ((share > 0.65) & (share < 1.45)).all()
    assert np.abs(np.mean(found, axis=0) / EXACT - 1).max() < 0.03
    assert abs(np.mean(chi2) - 4) < 2.3


def test_a_wrong_length_is_noticed():
    site = site_of()
    wrong = [*site.calibration.lengths[:2], (*site.calibration.lengths[2][:2], 9.0)]
    changed = site.model_copy(update={"calibration": site.calibration.model_copy(update={"lengths": tuple(wrong)})})
    fit = straight_road(changed)
    assert fit.contradiction
    assert "do not agree" in fit.doubts()[0]
    assert examined(changed).report["contradiction"]


def test_a_road_straight_ahead_does_not_tell_the_focal_length():
    ahead = np.where(np.arange(5) == 1, 0.0, TRUE)
    with pytest.raises(ConfigError, match="do not tell the focal length"):
        calibrated(site_of(ahead, lengths=LENGTHS[:1]))


BAD = {
    "a segment of no length": ({"along": [*ALONG, ((1, 20), (1, 20))]}, "begins and ends in one point"),
    "one direction": ({"along": ALONG[:1]}, "at least 2 directions and 1 length"),
    "no length": ({"lengths": []}, "at least 2 directions and 1 length"),
    "one across": ({"across": ACROSS[:1]}, "at least 2 segments across"),
    "none across and no focal length": ({"across": []}, "at least 2 segments across"),
}


@pytest.mark.parametrize(("change", "words"), BAD.values(), ids=BAD)
def test_too_few_segments_are_refused(change, words):
    with pytest.raises(ValueError, match=words):
        site_of(**change)


def test_segments_that_no_camera_sees_are_refused():
    """Those along the road meet below it, or are parallel in the picture."""
    below = {
        "directions": [[[588, 187], [814, 579]], [[1172, 195], [1004, 623]]],
        "focal_px": 1100,
        "lengths": [[[655, 462], [756, 288], 12.0]],
    }
    parallel = {
        "directions": [[[300, 700], [500, 100]], [[700, 700], [900, 100]]],
        "across": [[[300, 200], [1000, 200]], [[300, 500], [1000, 500]]],
        "lengths": [[[400, 400], [400, 20], 30.0]],
    }
    for wrong in (below, parallel):
        camera = {"name": "road", "width": WIDTH, "height": HEIGHT}
        with pytest.raises(ConfigError, match="no camera above the road sees these segments"):
            calibrated(Site.model_validate({"site": camera, "calibration": wrong}))
