"""Runs of pixels: the same as a row-by-row search finds."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.video.runs import OBJECTS, find_runs, find_stretches


def runs_by_differences(chosen):
    edges = np.diff(np.pad(chosen.astype(int), ((0, 0), (1, 1))), axis=1)
    row, start = np.nonzero(edges == 1)
    stop = np.nonzero(edges == -1)[1]
    return np.column_stack([row, start, stop])


@given(
    shape=st.tuples(st.integers(1, 40), st.integers(1, 40)),
    share=st.sampled_from([0.0, 0.02, 0.5, 0.98, 1.0]),
    seed=st.integers(0, 2**32 - 1),
    background=st.booleans(),
)
@settings(max_examples=300, deadline=None)
def test_runs_are_maximal_in_raster_order_and_end_with_their_row(shape, share, seed, background):
    random = np.random.default_rng(seed)
    values = random.choice(np.array([1, 2, 127, 128, 255], np.uint8), shape)
    mask = np.where(random.random(shape) < share, values, np.uint8(0))
    chosen = mask == 0 if background else mask > 0
    assert np.column_stack(find_runs(mask, background)).tolist() == runs_by_differences(chosen).tolist()


@pytest.mark.parametrize("column", [0, 7, 8, 63, 64, 319])
def test_a_lone_pixel_in_a_large_picture_is_found(column):
    mask = np.zeros((240, 320), np.uint8)
    mask[239, column] = 255
    assert np.column_stack(find_runs(mask, OBJECTS)).tolist() == [[239, column, column + 1]]


@given(
    shape=st.tuples(st.integers(1, 40), st.integers(1, 100)),
    share=st.sampled_from([0.0, 0.002, 0.02, 0.5, 1.0]),
    seed=st.integers(0, 2**32 - 1),
)
@settings(max_examples=300, deadline=None)
def test_stretches_are_the_blocks_with_any_pixel_in_raster_order(shape, share, seed):
    mask = (np.random.default_rng(seed).random(shape) < share).astype(np.uint8)
    held = np.zeros(shape, bool)
    for row, start, stop in zip(*find_stretches(mask), strict=True):
        assert 0 <= start < stop <= shape[1]
        assert not held[row, start:].any()
        assert not held[row + 1 :].any()
        held[row, start:stop] = True
    blocks = mask.ravel()[: mask.size // 32 * 32].reshape(-1, 32)
    expected = np.ones(mask.size, bool)  # what fills no block is never left out
    expected[: blocks.size] = blocks.any(axis=1).repeat(32)
    np.testing.assert_array_equal(held.ravel(), expected)
