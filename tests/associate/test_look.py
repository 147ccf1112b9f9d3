"""The look of an object as evidence."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.associate.gate import Pairs
from vidtrack.associate.look import Look

RED, GREY = [80.0, 110.0, 200.0], [120.0, 128.0, 128.0]


def pairs(count):
    """Gated pairs of one track with each of `count` measurements, all of them equally near."""
    row, d2 = np.zeros(count, np.int64), np.ones(count)
    return Pairs(row, np.arange(count), d2, d2, 0 * d2, 0 * d2, d2.copy(), np.array([9.0]), np.array([0, count]))


def test_the_same_look_is_likelier_and_cheaper():
    weighed = Look().weigh(pairs(2), np.array([RED]), np.array([RED, GREY]))
    assert weighed.log_l[0] > 0 > weighed.log_l[1]
    np.testing.assert_allclose(weighed.cost, 1 - 2 * weighed.log_l)


def test_no_pair_leaves_the_gate_by_its_look():
    weighed = Look().weigh(pairs(2), np.array([RED]), np.array([RED, GREY]))
    np.testing.assert_array_equal(weighed.measurement, [0, 1])
    np.testing.assert_array_equal(weighed.d2, [1.0, 1.0])


def test_a_track_whose_look_is_not_known_takes_any():
    weighed = Look().weigh(pairs(2), np.full((1, 3), np.nan), np.array([RED, GREY]))
    np.testing.assert_array_equal(weighed.log_l, [0.0, 0.0])


looks = st.lists(st.floats(0, 255), min_size=3, max_size=3)


@given(looks, looks)
def test_the_ratio_is_that_of_two_normal_densities_and_bounded(mine, theirs):
    look, nothing = Look(), np.zeros(1, np.int64)
    d = np.subtract(mine, theirs)
    same, other = np.array([look.same[0], *2 * [look.same[1]]]), np.array([look.other[0], *2 * [look.other[1]]])
    expected = (np.log(other / same) - d**2 / 2 / same**2 + d**2 / 2 / other**2).sum()
    told = look.ratio(np.array([mine]), np.array([theirs]), nothing, nothing)
    np.testing.assert_allclose(told, max(expected, -look.most), rtol=1e-9, atol=1e-9)
