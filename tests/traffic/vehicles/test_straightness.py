"""Straight paths tell a calibration whose lanes converge, or bend as by a lens."""

from dataclasses import replace

import numpy as np
import pytest
from driven import CAMERA, GROUND
from pinhole import POINTS, site_of

from vidtrack.traffic.calibration.calibrate import calibrated
from vidtrack.traffic.calibration.lens import Lens
from vidtrack.traffic.vehicles.straightness import paths_of, straightness

LANES = (-5.25, -1.75, 1.75, 5.25)


def told(ground, picture=CAMERA.picture, seed=0, each=8, across=()):
    """What vehicles say in four parallel lanes and in others across, who drive 0.1 m from their middle."""
    rng = np.random.default_rng(seed)
    s = np.linspace(-15, 15, 16)

    def off():
        return 0.1 * rng.standard_normal() + 0.003 * rng.standard_normal() * s

    lines = [np.column_stack([lane + off(), 29 + s]) for lane in LANES for _ in range(each)]
    lines += [np.column_stack([0.6 * s, lane + off() / 2]) for lane in across for _ in range(each)]
    first = len(s) * np.arange(len(lines) + 1)
    paths = paths_of(ground, ground.metres(picture(np.concatenate(lines))), first, np.ones(len(lines), bool))
    return straightness(paths)


@pytest.mark.parametrize("seed", range(20))
def test_right_points_are_not_doubted(seed):
    noise = np.random.default_rng(seed).normal(0, 1, (4, 2))
    corners = POINTS[[0, 1, 4, 5]]
    found = told(calibrated(site_of(CAMERA.picture(corners) + noise, corners, sigma_picture_px=1.0)), seed=seed)
    assert not found.converges
    assert not found.bends
    assert found.paths == len(LANES) * 8


def test_a_wrong_point_of_four_makes_lanes_converge():
    corners = POINTS[[0, 1, 4, 5]]
    seen = CAMERA.picture(corners)
    seen[3] -= [40, 0]
    found = told(calibrated(site_of(seen, corners, sigma_picture_px=1.0)))
    assert found.converges
    assert found.told()["converges"] is True


def test_a_lens_that_the_calibration_does_not_know_bends_paths():
    lens = Lens(-0.2, 0.0, 900.0, tuple(GROUND.center))
    found, known = (
        told(ground, lambda xy: lens.bent(CAMERA.picture(xy)), each=20, across=(15, 20, 25, 40))
        for ground in (GROUND, replace(GROUND, lens=lens))
    )
    assert found.bends
    assert found.lens < 0
    assert not known.bends


def test_few_paths_say_nothing():
    assert told(GROUND, each=2) is None
