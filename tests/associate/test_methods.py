"""What every one-scan method owes, whatever the problem: weights that sum to one, and exclusivity where promised."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from problems import random_problem, table

from vidtrack.associate.generalized_nn import GeneralizedNN
from vidtrack.associate.hard import GNN, NN, GreedyGNN
from vidtrack.associate.jpda import JPDA
from vidtrack.associate.pda import PDA
from vidtrack.associate.strongest import PSN, StrongestNeighbour

SHARING = [NN(), GeneralizedNN(), StrongestNeighbour(), PSN(), PSN(printed=True), PDA(), PDA(inflate=True)]
EXCLUSIVE = [
    GNN(), GNN("maximum-cardinality"), GreedyGNN(), GreedyGNN("track"),
    JPDA(), JPDA(star=True), JPDA(largest=0), JPDA(largest=64),
]  # fmt: skip
ALL = SHARING + EXCLUSIVE
probability = st.sampled_from([0.0, 0.3, 0.9, 0.999, 1.0])


@pytest.mark.parametrize("method", ALL, ids=repr)
@given(
    seed=st.integers(0, 2**32 - 1),
    rows=st.integers(0, 7),
    count=st.integers(0, 7),
    gate=probability,
    detection=probability,
    clutter=st.sampled_from([0.0, 1e-300, 1e-5, 0.1, 1e3]),
    spread=st.sampled_from([0.0, 1e-3, 1.0, 30.0]),
)
@settings(max_examples=40, deadline=None)
def test_weights_are_probabilities(method, seed, rows, count, gate, detection, clutter, spread):
    rng = np.random.default_rng(seed)
    problem = random_problem(
        rng, rows, count, gate=gate, detection=detection, clutter=clutter, spread=spread, amplitude=True
    )
    decision = method.decide(problem)
    weights = table(problem, decision)
    assert (weights >= 0).all()
    np.testing.assert_allclose(weights.sum(axis=1), 1.0, rtol=1e-9)
    np.testing.assert_array_equal(decision.parent, np.arange(rows))
    assert (np.diff(decision.row) >= 0).all()
    gated = np.zeros((rows, count), bool)
    gated[problem.pairs.row, problem.pairs.measurement] = True
    assert not weights[:, 1:][~gated].any(), "a measurement outside the gate counts"
    if method in EXCLUSIVE:
        assert (weights[:, 1:].sum(axis=0) <= 1 + 1e-9).all()


ORDERLESS = [method for method in ALL if method != GreedyGNN("track")]  # whose rule is the order of the tracks


@pytest.mark.parametrize("method", ORDERLESS, ids=repr)
def test_order_of_the_tracks_does_not_matter(method):
    rng = np.random.default_rng(11)
    problem = random_problem(rng, 6, 8, gate=0.999, amplitude=True)
    order = rng.permutation(6)
    turned = reordered(problem, order)
    np.testing.assert_allclose(
        table(turned, method.decide(turned)), table(problem, method.decide(problem))[order], atol=1e-6
    )


def reordered(problem, order):
    """The same problem with its rows in another order."""
    pairs = problem.pairs
    place = np.argsort(order)
    keys = np.lexsort((pairs.measurement, place[pairs.row]))
    moved = replace(
        pairs,
        **{name: getattr(pairs, name)[keys] for name in ("measurement", "d2", "nis", "log_s", "log_l", "cost")},
        row=place[pairs.row][keys],
        limit=pairs.limit[order],
        start=np.concatenate([[0], np.cumsum(np.diff(pairs.start)[order])]),
    )
    return replace(
        problem,
        pairs=moved,
        cov=problem.cov[order],
        detection=problem.detection[order],
        clutter=problem.clutter[order],
        inside=problem.inside[order],
    )
