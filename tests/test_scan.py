"""Scans refuse what no filter could use, and say which measurement it was."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.decision import Decision
from vidtrack.errors import Error, ScanError
from vidtrack.scan import Scan

EYE = np.eye(2)


@given(count=st.integers(0, 20), dim=st.sampled_from([1, 2, 3]))
@settings(deadline=None)
def test_one_covariance_is_taken_for_all(count, dim):
    z = np.arange(float(count * dim)).reshape(count, dim)
    scan = Scan(1, z, 2 * np.eye(dim))
    assert len(scan) == count
    assert scan.t == 1.0
    assert scan.R.shape == (count, dim, dim)
    np.testing.assert_array_equal(scan.R, np.tile(2 * np.eye(dim), (count, 1, 1)))
    assert scan.R.flags.c_contiguous  # kernels are compiled anew for another layout, and for what is read only
    assert scan.R.flags.writeable


def test_empty_scan_is_a_scan():
    for R in (EYE, np.empty((0, 2, 2))):
        assert len(Scan(0.0, np.empty((0, 2)), R, box=np.empty((0, 4)))) == 0


def test_an_empty_list_is_a_scan_without_measurements():
    scan = Scan(0.0, [], EYE)
    assert scan.z.shape == (0, 2)
    assert scan.R.shape == (0, 2, 2)


def test_boxes_of_negative_size_are_refused_by_measurement():
    box = [[0, 0, 4, 2], [0, 0, 4, -2]]
    with pytest.raises(ScanError, match=r"box of measurement 1 .*-2.*width"):
        Scan(0.0, np.zeros((2, 2)), EYE, box=box)


def test_lists_and_integers_become_arrays_of_floats():
    scan = Scan(0, [[1, 2], [3, 4]], [[1, 0], [0, 1]], box=[[0, 0, 2, 2]] * 2, score=[1, 2], label=[0.0, 1.0])
    assert scan.z.dtype == scan.R.dtype == scan.box.dtype == scan.score.dtype == float
    assert scan.label.dtype == np.int64


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("where", ["z", "R", "box", "amplitude", "score"])
def test_numbers_that_are_not_finite_are_refused_by_measurement(bad, where):
    parts = {"z": np.zeros((4, 2)), "R": np.tile(EYE, (4, 1, 1)), "box": np.ones((4, 4))}
    parts |= {"amplitude": np.ones(4), "score": np.ones(4)}
    parts[where][2, ...] = bad
    with pytest.raises(ScanError, match=r"measurement 2.*(nan|inf)"):
        Scan(0.0, **parts)


@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_time_must_be_finite(bad):
    with pytest.raises(ScanError, match=str(bad)):
        Scan(bad, np.zeros((1, 2)), EYE)


@pytest.mark.parametrize(
    ("R", "complaint"),
    [
        ([[1, 0.5], [0, 1]], "symmetric"),
        ([[1, 1], [1, 1]], "positive definite"),
        ([[1, 2], [2, 1]], "positive definite"),
        ([[-1, 0], [0, 1]], "positive definite"),
        ([[-1, 0], [0, -1]], "positive definite"),
        ([[0, 0], [0, 0]], "positive definite"),
        ([[1, 0], [0, 0]], "positive definite"),
    ],
)
def test_what_is_no_covariance_is_refused_by_measurement(R, complaint):
    several = np.tile(EYE, (5, 1, 1))
    several[3] = R
    with pytest.raises(ScanError, match=rf"measurement 3 .*{complaint}"):
        Scan(0.0, np.zeros((5, 2)), several)


@pytest.mark.parametrize("dim", [1, 3])
def test_singular_covariance_is_refused_in_any_dimension(dim):
    R = np.eye(dim)
    R[-1, -1] = 0.0
    with pytest.raises(ScanError, match="measurement 0 is not positive definite"):
        Scan(0.0, np.zeros((1, dim)), R)


@pytest.mark.parametrize(
    ("noise", "complaint"),
    [(np.nan * EYE, "finite"), ([[1, 2], [0, 1]], "symmetric"), (-EYE, "positive definite")],
)
def test_noise_is_a_covariance_too(noise, complaint):
    with pytest.raises(ScanError, match=f"^noise is not {complaint}"):
        Scan(0.0, np.zeros((3, 2)), EYE, noise=noise)
    with pytest.raises(ScanError, match=f"^R is not {complaint}"):  # one for all, though there are none
        Scan(0.0, np.empty((0, 2)), noise)


def test_runs_are_numbered_from_zero():
    with pytest.raises(ScanError, match="run of measurement 1 is -1"):
        Scan(0.0, np.zeros((3, 2)), EYE, run=[0, -1, 2])


def test_a_class_that_is_no_number_is_refused():
    with pytest.raises(ScanError, match="label of measurement 1 is not finite"):
        Scan(0.0, np.zeros((2, 2)), EYE, label=[1.0, np.nan])


@given(scale=st.sampled_from([1e-12, 1e-6, 1.0, 1e6, 1e12]))
@settings(deadline=None)
def test_units_do_not_decide_what_is_a_covariance(scale):
    assert len(Scan(0.0, np.zeros((1, 2)), scale * np.array([[2.0, 1.0], [1.0, 2.0]]))) == 1
    with pytest.raises(ScanError):
        Scan(0.0, np.zeros((1, 2)), scale * np.array([[1.0, 2.0], [2.0, 1.0]]))


@pytest.mark.parametrize(
    ("parts", "shape"),
    [
        ({"z": np.zeros(2), "R": EYE}, "(2,)"),
        ({"z": np.zeros((3, 2)), "R": np.eye(3)}, "(3, 3)"),
        ({"z": np.zeros((3, 2)), "R": np.tile(EYE, (2, 1, 1))}, "(2, 2, 2)"),
        ({"z": np.zeros((3, 2)), "R": 1.0}, "()"),
        ({"z": np.zeros((3, 2)), "R": EYE, "box": np.zeros((2, 4))}, "(2, 4)"),
        ({"z": np.zeros((3, 2)), "R": EYE, "box": np.zeros((3, 2))}, "(3, 2)"),
        ({"z": np.zeros((3, 2)), "R": EYE, "score": np.zeros(1)}, "(1,)"),
        ({"z": np.zeros((3, 2)), "R": EYE, "run": np.zeros((3, 1), int)}, "(3, 1)"),
    ],
)
def test_wrong_shapes_are_refused_by_what_was_given(parts, shape):
    with pytest.raises(ScanError) as caught:
        Scan(0.0, **parts)
    assert shape in str(caught.value)


def test_scan_errors_are_ours_and_value_errors():
    with pytest.raises(ScanError) as caught:
        Scan(0.0, np.zeros(2), EYE)
    assert isinstance(caught.value, Error)
    assert isinstance(caught.value, ValueError)


def decision(taken):
    """One-hot decision from each row's measurement, -1 for none."""
    taken = np.array(taken)
    row = np.flatnonzero(taken >= 0)
    return Decision(np.arange(len(taken)), row, taken[row], np.ones(len(row)), (taken < 0).astype(float))


def test_decisions_about_disjoint_rows_join():
    joined = decision([4, -1, -1, 2]).joined(decision([-1, 0, -1, -1]))
    np.testing.assert_array_equal(joined.row, [0, 1, 3])
    np.testing.assert_array_equal(joined.measurement, [4, 0, 2])
    np.testing.assert_array_equal(joined.beta0, [0, 0, 1, 0])


def test_a_decision_without_some_rows_misses_them():
    rest = decision([4, 1, -1]).without(np.array([True, False, False]))
    np.testing.assert_array_equal(rest.row, [1])
    np.testing.assert_array_equal(rest.beta0, [1, 0, 1])
