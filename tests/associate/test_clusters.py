"""Clusters of the gate graph are its connected components."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from vidtrack.associate.clusters import clusters


@given(
    seed=st.integers(0, 2**32 - 1),
    rows=st.integers(0, 30),
    count=st.integers(1, 30),
    density=st.sampled_from([0.0, 0.05, 0.3]),
)
@settings(max_examples=200, deadline=None)
def test_clusters_are_connected_components(seed, rows, count, density):
    row, measurement = np.argwhere(np.random.default_rng(seed).random((rows, count)) < density).T.copy()
    found = clusters(row, measurement, rows, count)
    graph = coo_array((np.ones(len(row)), (row, rows + measurement)), shape=(rows + count,) * 2)
    label = connected_components(graph, directed=False)[1][:rows]
    first = np.array([np.flatnonzero(label == label[t])[0] for t in range(rows)], int)
    np.testing.assert_array_equal(found, first)


def test_example_of_the_survey():
    """SPEC 001, `clusters`: T0, T1 share measurement 1; T2, T4 share 2; T3 is alone."""
    row, measurement = np.array([0, 0, 1, 2, 4, 4]), np.array([0, 1, 1, 2, 3, 2])
    np.testing.assert_array_equal(clusters(row, measurement, 5, 5), [0, 0, 2, 3, 2])


def test_long_chain_is_one_cluster():
    row = np.repeat(np.arange(5000), 2)[1:]
    measurement = np.repeat(np.arange(5000), 2)[:-1]
    assert (clusters(row[::-1].copy(), measurement[::-1].copy(), 5000, 5000) == 0).all()
