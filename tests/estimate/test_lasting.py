"""What errors that last are worth."""

import numpy as np
import pytest

from vidtrack.associate.redundancy import combined
from vidtrack.errors import ScanError
from vidtrack.estimate.lasting import LASTING_S, inflation
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
