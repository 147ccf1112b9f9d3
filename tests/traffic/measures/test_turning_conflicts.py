"""Encroachments where one vehicle turns into the way of another: what headings and their errors decide."""

from dataclasses import replace

import numpy as np
import pytest
from meeting_rows import bend, both, driven, found_in, rows_of

from vidtrack.simulate.roads.stage import footprints
from vidtrack.simulate.scene import touching
from vidtrack.traffic.measures.conflicts import PET


@pytest.mark.parametrize(("first", "second"), [(np.pi / 2, np.pi / 2), (0.0, np.pi / 2), (np.pi / 2, 0.0)])
def test_vehicles_behind_each_other_have_no_encroachment_on_a_bend_and_where_one_turns_off(first, second):
    rows = both(bend(0, 0.0, first), bend(1, 2.0, second))
    assert len(found_in(rows)) == 0
    assert len(found_in(rows, block=20)) == 0


def test_one_that_turns_into_the_way_of_another_encroaches():
    track, t, xy, v = bend(1, 2.0, np.pi / 2)
    turned = np.array([30.0, 37.0]) + np.column_stack([xy[:, 1], -xy[:, 0]])  # from the north to the east
    south = np.column_stack([v[:, 1], -v[:, 0]])
    found = found_in(both(bend(0, 0.0, 0.0), (track, t, turned, south)))
    assert (found.first.tolist(), found.second.tolist()) == ([0], [1])
    assert 0 < found.value[PET, 0] < 5
    assert found.kinds[0] in ("merging", "crossing")


def test_errors_of_headings_are_those_of_the_time_where_one_turns_into_the_way_of_another():
    """Where the headings cross clearly nothing depends on them."""
    track, t, xy, v = bend(1, 2.0, np.pi / 2)
    turned = np.array([30.0, 37.0]) + np.column_stack([xy[:, 1], -xy[:, 0]])  # from the north to the east
    south = np.column_stack([v[:, 1], -v[:, 0]])
    merging = both(bend(0, 0.0, 0.0), (track, t, turned, south))
    crossing = rows_of(*driven((0, 0, 10, 0), (20, -65, 0, 12)))
    for rows, depends in ((merging, True), (crossing, False)):
        values, sigmas = [], []
        for sigma in (0.0, 1.2):
            found = found_in(replace(rows, speed_sigma=np.full(len(rows), sigma)))
            values.append(found.value[PET, 0])
            sigmas.append(found.sigma[PET, 0])
        assert values[0] == values[1]
        assert (sigmas[1] > sigmas[0] + 0.01) == depends


def merging(turn_rad):
    """One that drives east, and one that turns onto its way by an angle, 2 s later."""
    track, t, xy, v = bend(1, 2.0, turn_rad)
    cos, sin = np.cos(turn_rad), np.sin(turn_rad)
    away = np.array([[cos, -sin], [sin, cos]])  # by which it ends on the way to the east
    return both(bend(0, 0.0, 0.0), (track, t, np.array([60.0, 0.0]) + (xy - xy[-1]) @ away, v @ away))


def along_chords(rows, reach_s=0.6):
    """(N,) rad; the headings of the ways from as long before as after, up to 0.6 s."""
    angle = np.arctan2(rows.v[:, 1], rows.v[:, 0])
    for i, (track, t) in enumerate(zip(rows.track, rows.t, strict=True)):
        own = np.flatnonzero(rows.track == track)
        reach = min(reach_s, t - rows.t[own[0]], rows.t[own[-1]] - t) + 1e-6
        first, *_, last = [k for k in own if abs(rows.t[k] - t) <= reach] * 2
        dx, dy = rows.xy[last] - rows.xy[first]
        angle[i] = np.arctan2(dy, dx) if np.hypot(dx, dy) >= 3 else angle[i]
    return angle


@pytest.mark.parametrize(("turn_deg", "speed_sigma"), [(90, 1.4), (38, 0.7)])
def test_the_error_by_headings_is_half_of_what_the_wait_gains_if_they_must_differ_by_two_sigmas_more(
    turn_deg, speed_sigma
):
    """By the waits of all pairs of rows; on the lesser turn headings nowhere differ by so much, and it is 5 s."""
    rows = merging(np.radians(turn_deg))
    angle = along_chords(rows)
    base = footprints(rows.xy, angle, np.full(len(rows), 4.0), np.full(len(rows), 1.8))
    i, j = (k.ravel() for k in np.meshgrid(*(np.flatnonzero(rows.track == one) for one in (0, 1))))
    apart = np.arccos(np.cos(angle[i] - angle[j]))
    hit = touching(base[i], base[j])
    wait = [np.abs(rows.t[i] - rows.t[j])[hit & (apart >= np.radians(30) + more)].min(initial=5.0)
            for more in (0.0, 2 * 0.6 * np.hypot(speed_sigma, speed_sigma) / 6)]  # fmt: skip
    sigma = [found_in(replace(rows, speed_sigma=np.full(len(rows), one))).sigma[PET, 0] for one in (0.0, speed_sigma)]
    assert wait[1] > wait[0] + 0.02
    assert np.sqrt(sigma[1] ** 2 - sigma[0] ** 2) == pytest.approx((wait[1] - wait[0]) / 2, abs=1e-6)


def test_ways_whose_headings_hardly_differ_cross_nowhere_for_sure():
    """34 degrees are more than 30, but with 5.7 degrees of error nobody knows."""
    rows = merging(np.radians(34))
    there = [len(found_in(replace(rows, speed_sigma=np.full(len(rows), sigma)))) for sigma in (0.0, 0.7)]
    assert there == [1, 0]


def test_headings_are_those_of_the_way_where_velocities_follow_a_turn_late():
    """By 5 degrees, as those of a filter do."""
    rows = merging(np.radians(38))
    late = np.radians(5) * (np.abs(along_chords(rows)) > 0)
    cos, sin = np.cos(late), np.sin(late)
    v = np.column_stack([cos * rows.v[:, 0] - sin * rows.v[:, 1], sin * rows.v[:, 0] + cos * rows.v[:, 1]])
    lagging = replace(rows, v=v, ahead=v / np.linalg.norm(v, axis=1)[:, None])
    exact, found = found_in(rows), found_in(lagging)
    assert found.when[PET].tolist() == exact.when[PET].tolist()
    assert found.angle == pytest.approx(exact.angle, abs=1e-9)
