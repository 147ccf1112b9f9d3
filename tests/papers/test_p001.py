"""The survey's figures, by our own code."""

import numpy as np
import pytest

from vidtrack.papers.p001 import close, fig2, fig3, fig4, fig5
from vidtrack.scan import Scan


def test_four_observations_are_taken_as_an_independent_calculation_has_it():
    rows = fig2.reproduce(None, 0).rows
    assert all(row["d2"] == pytest.approx(row["reference_d2"]) for row in rows)
    for rule in ("nn", "greedy", "gnn"):
        assert [(row["track"], row["observation"]) for row in rows if row[rule]] == [("P1", "O2"), ("P2", "O3")]
    assert fig2.counted(Scan(0.0, fig2.OBSERVED, fig2.HALF)) == (fig2.BRANCHES, fig2.HYPOTHESES)


def test_the_gate_shrinks_and_still_holds_its_share():
    rows = fig3.reproduce(4000, 1).rows
    radius = [row["gate_radius_m"] for row in rows]
    assert radius == sorted(radius, reverse=True)
    assert radius[0] > 3 * radius[-1]
    for row in rows:
        assert row["inside"] == pytest.approx(fig3.GATE, abs=4.5 * row["inside_se"])


def test_branching_tells_close_targets_apart_more_often_than_nearest_neighbour():
    rows = {row["method"]: row for row in fig5.reproduce(100, 2).rows}
    assert rows["split"]["both_right"] > rows["nn"]["both_right"] + 0.15
    assert rows["mht"]["both_right"] > rows["split"]["both_right"]
    assert fig4.reproduce(100, 2).rows == list(rows.values())


def test_a_run_is_right_only_if_both_targets_keep_their_own_track():
    pair = close.Pair.fly(3, 0)
    steps = pair.tracked(close.METHODS["gnn"]())
    track, away = close.nearest(steps[-1], pair.truth[-1])
    assert track.shape == away.shape == (3, 2)
    known = steps[-1].only(steps[-1].status > 0)
    for run in range(3):
        mine = known.run == run
        distance = np.linalg.norm(known.xy[mine] - pair.truth[-1, run, 0], axis=1)
        assert away[run, 0] == pytest.approx(distance.min())
        assert track[run, 0] == known.id[mine][distance.argmin()]
