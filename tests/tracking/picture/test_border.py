"""What the border of the picture cuts."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.tracking.picture.border import Border

PICTURE = Border(100, 80)
BOXES = np.array([[1.0, 20.0, 10.0, 10.0], [50.0, 1.0, 10.0, 10.0], [95.0, 75.0, 10.0, 10.0], [50.0, 40.0, 10.0, 10.0]])
CUT = np.array([[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 1], [0, 0, 0, 0]], bool)


def states(xy, var):
    """States [x, vx, y, vy] at rest and their covariances."""
    x, P = np.zeros((len(xy), 4)), np.zeros((len(xy), 4, 4))
    x[:, ::2], P[:, 0, 0], P[:, 2, 2] = xy, var[:, 0], var[:, 1]
    return x, P


def test_a_box_is_cut_on_the_sides_that_reach_the_border():
    np.testing.assert_array_equal(PICTURE.sides(BOXES), CUT)
    np.testing.assert_array_equal(PICTURE.cut(BOXES), [True, True, True, False])


def test_without_a_border_nothing_is_cut():
    assert not Border().sides(BOXES).any()
    assert (Border().in_view(*states(BOXES[:, :2] - 1000, BOXES[:, 2:])) == 1).all()


def test_the_probability_to_be_in_view_is_the_share_of_the_position_within_the_border():
    xy = np.array([[50.0, 40.0], [99.5, 40.0], [99.5, 79.5], [-30.0, 40.0], [3.0, 70.0]])
    var = np.array([[4.0, 4.0], [4.0, 4.0], [9.0, 1.0], [25.0, 25.0], [16.0, 100.0]])
    found = PICTURE.in_view(*states(xy, var))
    np.testing.assert_allclose(found[:4], [1, 0.5, 0.25, 0], atol=1e-8)
    drawn = xy[4] + np.sqrt(var[4]) * np.random.default_rng(1).normal(size=(100_000, 2))
    within = np.all((drawn > -0.5) & (drawn < [99.5, 79.5]), axis=1)
    assert abs(found[4] - within.mean()) < 0.006


def test_cut_boxes_are_drawn_out_to_the_border_and_no_farther():
    drawn = PICTURE.reaching(BOXES - [0.0, 0.0, 8.0, 8.0], CUT)
    np.testing.assert_array_equal(
        drawn, [[0.0, 20.0, 3.0, 2.0], [50.0, 0.0, 2.0, 3.0], [95.0, 75.0, 5.0, 5.0], [50.0, 40.0, 2.0, 2.0]]
    )


def seen_over_time(left, side):
    """Whether a box of 40 x 20 that moves along one axis to these places is taken for another one, at each of them."""
    shown = np.full((1, 4, 2), np.nan)
    found = []
    for before, now in zip([left[0], *left], left, strict=False):
        place = [now, 30.0, 40.0, 20.0] if side in (0, 2) else [30.0, now, 20.0, 40.0]
        v = (
            np.array([[now - before, 0.0] if side in (0, 2) else [0.0, now - before]]) * 5
        )  # px/s, five pictures a second
        found.append(bool(PICTURE.relieved(np.array([place]), v, np.ones(1, bool), shown)[0]))
    return found


OUT_AND_IN = {
    0: [5, -5, -15, -25, -20, -10, 0],
    1: [5, -5, -15, -25, -20, -10, 0],
    2: [55, 65, 75, 85, 80, 70, 60],
    3: [35, 45, 55, 65, 60, 50, 40],
}


def test_who_drove_out_over_a_side_and_comes_in_again_is_another_one():
    for side, places in OUT_AND_IN.items():
        assert seen_over_time(places, side) == [False] * 5 + [True] * 2


def test_who_only_leaves_or_only_comes_in_is_not():
    for side, places in OUT_AND_IN.items():
        assert not any(seen_over_time(places[:4], side))
        assert not any(seen_over_time(places[3:], side))


def test_an_outline_that_flickers_at_the_border_is_not():
    assert not any(seen_over_time([5, -5, -12, -6, -15, -20, -16, -25, -30], 0))
    assert not any(seen_over_time([-30, -22, -26, -15, -18, -8, -12, 0], 0))


@given(st.integers(0, 2**32 - 1), st.floats(0, 2))
def test_who_stands_at_the_border_stays(seed, jitter_px):
    """The inner edge of a vehicle of 40 px, of which 20 px are seen, shakes, and so does its velocity."""
    random = np.random.default_rng(seed)
    shown = np.full((1, 4, 2), np.nan)
    for k in range(300):
        inner = 40 - min(20, 4 * k) + jitter_px * np.clip(random.normal(), -2, 2)
        v = np.array([[-20.0 if k < 6 else 4 * random.normal(), 0.0]])
        assert not PICTURE.relieved(np.array([[0.0, 30.0, inner, 20.0]]), v, np.ones(1, bool), shown)[0]


def test_an_edge_of_the_picture_that_sways_over_a_standing_vehicle_changes_nothing():
    shown, box = np.full((1, 4, 2), np.nan), np.array([[0.0, 30.0, 40.0, 20.0]])
    for k in range(100):
        edge = 10 + 12 * np.sin(k / 5)
        seen = np.array([[max(edge, 0.0), 30.0, 40.0 - max(edge, 0.0), 20.0]])
        v = np.array([[60 * np.cos(k / 5), 0.0]])
        border = Border(100, 80, left=edge)
        assert not border.relieved(seen if edge > 0 else box, v, np.ones(1, bool), shown)[0]


def test_without_a_border_nobody_comes_in():
    box, v, shown = BOXES[:1], np.ones((1, 2)), np.array([[[100.0, 0.0]] * 4])
    assert not Border().relieved(box, v, np.ones(1, bool), shown).any()
