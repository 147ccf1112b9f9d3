"""How R follows from what was measured, and what errors that last are worth."""

import numpy as np
import pytest

from vidtrack.associate.redundancy import combined
from vidtrack.errors import ScanError
from vidtrack.estimate.noise import (
    LASTING_S,
    as_if_new,
    blob_noise,
    box_noise,
    edge_sigma,
    edge_variance,
    file_noise,
    for_update,
    inflation,
    middle_variance,
)
from vidtrack.scan import Scan


@pytest.mark.parametrize("fps", [5, 10, 25, 30, 60])
def test_a_second_tells_the_same_at_all_frame_rates(fps):
    """The mean of a second's lasting errors has the variance R inflation / scans."""
    assert inflation(1 / fps) / fps == pytest.approx(2 * LASTING_S)


def test_a_first_scan_and_rare_ones_count_in_full():
    assert inflation(0.0) == inflation(5.0) == 1.0


def test_only_the_lasting_part_counts_less():
    scan = Scan(0.0, np.zeros((2, 2)), 3 * np.eye(2), lasting=np.array([np.eye(2), np.diag([1.0, 2.0])]))
    np.testing.assert_allclose(scan.weakened(10.0).R, [np.diag([12.0, 12.0]), np.diag([12.0, 21.0])])
    np.testing.assert_allclose(scan.weakened(1.0).R, scan.R)


def test_where_nothing_lasts_nothing_changes():
    scan = Scan(0.0, np.zeros((2, 2)), np.eye(2))
    assert scan.weakened(30.0) is scan


def test_it_is_one_for_each_measurement():
    with pytest.raises(ScanError, match="lasting"):
        Scan(0.0, np.zeros((2, 2)), np.eye(2), lasting=np.eye(2))


def test_measurements_that_become_one_keep_it():
    scan, _ = combined(Scan(0.0, np.zeros((2, 2)), np.eye(2), lasting=np.tile(np.eye(2) / 2, (2, 1, 1))))
    np.testing.assert_allclose(scan.lasting, [np.eye(2) / 2])


def test_a_blob_errs_by_its_border_and_along_its_extent():
    R, lasting = blob_noise(np.array([np.diag([100.0, 25.0])]), 2, 0.5, 0.1)
    np.testing.assert_allclose(lasting, [np.diag([1.0, 0.25])])
    np.testing.assert_allclose(R, [np.diag([2.0, 1.25])])


def test_a_box_errs_in_proportion_to_its_longer_side_but_never_less_than_half_a_pixel():
    R = box_noise(np.array([40.0, 2.0]), 0.05)
    np.testing.assert_allclose(R, [4.0 * np.eye(2), 0.25 * np.eye(2)])


@pytest.mark.parametrize(("side", "share", "pixel"), [(40.0, 0.1, 1.0), (3.0, 0.1, 4.0), (0.0, 0.1, 1.0)])
def test_an_edge_errs_by_a_share_of_the_side_and_a_pixel(side, share, pixel):
    assert edge_variance(side, share, pixel) == pytest.approx((share * side) ** 2 + pixel**2)
    assert edge_sigma(side, share, pixel) ** 2 == pytest.approx(edge_variance(side, share, pixel))


def test_the_middle_of_a_blob_is_as_wrong_as_its_size():
    blob, vehicle = np.array([[60.0, 20.0]]), np.array([[40.0, 20.0]])
    np.testing.assert_allclose(middle_variance(blob, vehicle), [[10.0**2 + 4.0**2 + 1.0, 2.0**2 + 1.0]])


def test_a_files_jitter_and_acceleration_are_told_apart_by_lags():
    lag = np.array([0.1, 0.2, 0.4, 0.8])
    jitter, accel = file_noise(lag, 6 * 0.03**2 + 2 / 3 * 0.7**2 * 0.5 * lag**3, 0.5)
    assert (jitter, accel) == (pytest.approx(0.03), pytest.approx(0.7))


@pytest.mark.parametrize("dt", [0.0, 0.04, 3.0])
def test_an_update_has_lasting_errors_inflated(dt):
    R = np.array([[2.0, 3.0]])
    scan = Scan(0.0, np.zeros((1, 2)), np.array([np.diag(R[0])]), lasting=np.array([np.diag(R[0])]))
    np.testing.assert_allclose(np.diagonal(for_update(scan, dt).R, axis1=1, axis2=2), as_if_new(R, dt))
    np.testing.assert_allclose(as_if_new(R, dt), inflation(dt) * R)
