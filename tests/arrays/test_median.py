"""The compiled median against NumPy's."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.arrays.median import median

NUMBERS = st.lists(st.floats(-1e6, 1e6) | st.sampled_from([0.0, 1.0, 2.0]), min_size=1, max_size=60)


@given(NUMBERS)
def test_it_is_that_of_numpy(numbers):
    assert median(np.array(numbers)) == np.median(numbers)


def test_of_many_equal_values_it_is_that_value():
    assert median(np.full(1001, 3.5)) == 3.5
