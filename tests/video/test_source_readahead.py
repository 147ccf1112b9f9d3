"""Working ahead changes when things happen, not what happens."""

from __future__ import annotations

import threading

import pytest

from vidtrack.video.readahead import ReadAhead


def test_items_come_in_order_from_another_thread():
    def items():
        for i in range(50):
            yield i, threading.get_ident()

    numbers, threads = zip(*ReadAhead(items(), 3), strict=True)
    assert numbers == tuple(range(50))
    assert len({*threads}) == 1
    assert threading.get_ident() not in threads


def test_an_error_is_raised_where_its_item_would_have_come():
    def items():
        yield 1
        yield 2
        raise ValueError("the third")

    ahead = ReadAhead(items(), 8)
    assert [next(ahead), next(ahead)] == [1, 2]
    with pytest.raises(ValueError, match="the third"):
        next(ahead)
    assert list(ahead) == []


def test_it_is_never_further_ahead_than_its_depth():
    made = []

    def items():
        for i in range(100):
            made.append(i)
            yield i

    ahead = ReadAhead(items(), 3)
    for consumed, _ in enumerate(ahead):
        assert len(made) <= consumed + 1 + 3 + 1


def test_close_drops_what_was_read_ahead():
    ahead = ReadAhead(iter(range(100)), 3)
    next(ahead)
    ahead.close()
    ahead.close()
    assert list(ahead) == []
