"""Rows found by name, and room for more of them."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.arrays.rows import by_number, located, make_room

names = st.lists(st.integers(0, 30), unique=True, max_size=20)


@given(names, names)
def test_each_name_is_found_where_it_is_known(name, known):
    known = sorted(known)
    place = located(np.array(name, np.int64), np.array(known, np.int64))
    assert place.tolist() == [known.index(one) if one in known else -1 for one in name]


@given(st.lists(st.integers(5, 12), max_size=30))
def test_rows_in_order_of_numbers_keep_their_order(numbers):
    number = np.array(numbers, np.int64)
    assert by_number(number).tolist() == np.argsort(number, kind="stable").tolist()


def test_a_table_is_lengthened_in_place_by_a_quarter_at_least():
    table = np.arange(16.0).reshape(8, 2).copy()
    make_room(table, 8, np.nan)
    assert len(table) == 8
    make_room(table, 9, np.nan)
    assert table[:8].tolist() == np.arange(16.0).reshape(8, 2).tolist()
    assert table.shape == (10, 2)
    assert np.isnan(table[8:]).all()
    make_room(table, 40, -1.0)
    assert table.shape == (40, 2)
    assert (table[10:] == -1).all()
