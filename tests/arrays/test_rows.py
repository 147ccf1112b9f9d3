"""Rows found by name."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.arrays.rows import located

names = st.lists(st.integers(0, 30), unique=True, max_size=20)


@given(names, names)
def test_each_name_is_found_where_it_is_known(name, known):
    known = sorted(known)
    place = located(np.array(name, np.int64), np.array(known, np.int64))
    assert place.tolist() == [known.index(one) if one in known else -1 for one in name]
