"""What the border of the picture cuts comes in, and a small blob beside a vehicle must travel apart from it."""

import numpy as np
import pytest
from blob_scene import confirmed_ids, default_tracker, events, nearest_id, play
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.tracking.births import NEAR, pieces
from vidtrack.tracking.register import Register
from vidtrack.tracks import Status

WIDTH, HEIGHT = 320, 240


def seen_part(left, top, width, height):
    """What the picture shows of a box: left, top, width, height."""
    x, y = np.clip([left, left + width], 0, WIDTH), np.clip([top, top + height], 0, HEIGHT)
    return [x[0], y[0], x[1] - x[0], y[1] - y[0]]


def sides_of(box):
    """(1, 4) which sides of the picture cut a box (4,)."""
    left, top, width, height = box
    return np.array([[left <= 0, top <= 0, left + width >= WIDTH, top + height >= HEIGHT]])


def middle(box):
    return np.array([[box[0] + box[2] / 2, box[1] + box[3] / 2]])


def came_in_along(path):
    """A register of one row and its distances from the start, for what the picture shows of boxes (K, 4)."""
    register, travelled = Register(2), []
    for k, whole in enumerate(path):
        box = seen_part(*whole)
        relative = np.array([[-box[2] / 2, -box[3] / 2, box[2], box[3]]])
        if k == 0:
            register.append(0.0, middle(box), relative, 0.0, np.zeros(1, np.int64), sides=sides_of(box))
        register.box = relative
        register.move(middle(box), 0.04 * k)
        register.come_in(middle(box), sides_of(box))
        travelled.append(float(register.travel(middle(box))[0]))
    return register, np.array(travelled)


@pytest.mark.parametrize(
    ("start", "velocity"),
    [((-90, 100), (3, 0)), ((WIDTH - 10, 100), (-3, 0)), ((100, HEIGHT - 10), (0, -3)), ((-90, HEIGHT - 10), (3, -2))],
)
def test_a_vehicle_that_comes_in_has_travelled_as_far_as_it_drove(start, velocity):
    path = [(start[0] + k * velocity[0], start[1] + k * velocity[1], 100, 40) for k in range(60)]
    register, travelled = came_in_along(path)
    np.testing.assert_allclose(travelled, np.hypot(*velocity) * np.arange(60), atol=1.0001 * np.hypot(*velocity))
    assert register.came_in.tolist() == [True]
    assert not register.inward.any()


@given(st.floats(1, 6), st.floats(20, 150), st.integers(2, 80))
def test_the_distance_does_not_jump_when_a_vehicle_is_in(speed, length, scans):
    """All of the step in which it comes in counts twice, though the border cut it in a part of it only."""
    _, travelled = came_in_along(
        [(5 - length + speed * k, 100, length, 40) for k in range(min(scans, int(300 / speed)))]
    )
    moved = np.diff(travelled)
    assert (moved > speed - 1e-9).all()
    assert (moved < 2 * speed + 1e-9).all()
    assert np.count_nonzero(moved > speed + 1e-9) <= 1


def test_what_the_top_cuts_does_not_come_in():
    """Far vehicles come into view whole, and what the top cuts is near: it moves as it seems to."""
    register, travelled = came_in_along([(100, -60 + 2 * k, 30, 80) for k in range(60)])
    assert travelled[20] == pytest.approx(20)
    assert not register.inward.any()
    assert register.came_in.tolist() == [True]


def test_a_vehicle_that_begins_inside_and_leaves_does_not_come_in():
    register, _ = came_in_along([(200 + 4 * k, 100, 60, 40) for k in range(25)])
    assert register.came_in.tolist() == [False]


def test_who_stops_where_one_side_still_cuts_it_came_in():
    """A bus at the corner of the picture, cut by the bottom for as long as it is there."""
    register, travelled = came_in_along([(min(-140 + 3 * k, 20), 150, 160, 120) for k in range(80)])
    assert register.came_in.tolist() == [True]
    assert register.inward.tolist() == [[False, True]]
    assert travelled[-1] == pytest.approx(160, abs=3)


def test_a_large_slow_vehicle_that_the_border_cuts_is_confirmed_and_may_stop_there():
    """The rest of a bus never comes in: it stops with a third of it in the picture, and stands for ten seconds."""
    bus = play(
        default_tracker(), lambda t: [seen_part(-190 + min(25 * t, 75), 60, 200, 90)], 14.0, fps=12.5, jitter=0.2
    )
    assert confirmed_ids(bus) == {1}
    assert bus[-1].status.tolist() == [Status.CONFIRMED]
    assert bus[-1].entered.tolist() == [True]
    assert not events(bus, "delete")


BORN_S = 1.6
"""s; by then the large vehicle is confirmed."""


def beside(x_of_other, size=(12, 8), seconds=4.0, **settings):
    """A lorry of 90 x 50 px at 40 px/s, and a small blob below it, its left edge at x_of_other(t, x of the lorry)."""

    def vehicles(t):
        x = 10 + 40 * t
        return [[x, 60, 90, 50], [x_of_other(t, x), 116, *size]]

    tracker = default_tracker(**settings)
    seen = play(tracker, lambda t: vehicles(t)[: 1 + (t >= BORN_S)], seconds, jitter=0.1)
    other = [nearest_id(tracks, x_of_other(tracks.t, 10 + 40 * tracks.t) + size[0] / 2, 120) for tracks in seen]
    return seen, other


def test_a_small_vehicle_that_overtakes_a_large_one_is_a_track():
    seen, other = beside(lambda t, x: 60 + 70 * (t - BORN_S))
    assert confirmed_ids(seen) == {1, other[-1]}
    assert other[-1] != 1


def test_a_small_vehicle_that_stands_beside_a_passing_one_is_none_until_it_moves():
    seen, _ = beside(lambda t, x: 80.0)
    assert confirmed_ids(seen) == {1}


def test_what_goes_with_a_vehicle_is_a_piece_of_it():
    """A shadow or a wheel: it has travelled as far as the vehicle, and not apart from it."""
    seen, _ = beside(lambda t, x: x + 30)
    assert confirmed_ids(seen) == {1}


def test_what_goes_with_a_vehicle_that_comes_in_is_a_piece_of_it():
    """The lorry's middle moves half as fast as the lorry while the border cuts it."""

    def vehicles(t):
        x = 40 * t - 120
        return [seen_part(x, 60, 150, 60), [x + 120, 126, 12, 8]][: 1 + (t >= BORN_S)]

    seen = play(default_tracker(), vehicles, 1.3 + BORN_S, jitter=0.1)
    assert confirmed_ids(seen) == {1}
    assert len(seen[-1]) == 2


def test_inside_the_box_of_a_vehicle_nothing_begins():
    seen = play(default_tracker(), lambda t: [[10 + 40 * t, 60, 90, 50]], 1.0)
    inside = seen[-1].box[0, :2] + [30, 20]
    blobs = np.array([[*inside, 10, 8], [inside[0], 118, 10, 8], [250, 200, 10, 8], [*inside, 60, 40]])
    assert pieces(blobs, seen[-1].box).tolist() == [0, -1, -1, -1]
    assert pieces(blobs, seen[-1].box, NEAR).tolist() == [0, 0, -1, -1]
    assert pieces(blobs, np.empty((0, 4)), NEAR).tolist() == [-1] * 4
