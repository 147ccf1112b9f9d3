"""Conflicts: known times, brute force over exact rectangles, simulated roads, and errors by repetition."""

import numpy as np
import pytest
from drawn_runs import CALIBRATED, SITE, along, site, write_run
from hypothesis import example, given, settings
from hypothesis import strategies as st
from meeting_rows import driven, found_in, rows_of

from vidtrack.simulate import simulate_road
from vidtrack.simulate.roads.conflicts import conflicts as exact_conflicts
from vidtrack.simulate.roads.conflicts import time_to_collision
from vidtrack.simulate.roads.events import motion
from vidtrack.simulate.roads.stage import footprints
from vidtrack.simulate.scene import touching
from vidtrack.traffic.measures.bodies import least_of
from vidtrack.traffic.measures.conflicts import PET, TTC, Meeting
from vidtrack.traffic.measures.measure import measured

RANK = st.sampled_from([0.0, 1.0, 2.0, np.nan])


@given(st.lists(st.tuples(st.integers(0, 3), RANK, RANK), max_size=30))
def test_the_least_of_each_pair_is_that_of_a_sort(rows):
    pair, one, other = np.array(rows, float).reshape(-1, 3).T
    order = np.lexsort((other, one, pair))
    first = order[np.diff(pair[order], prepend=-1) != 0]
    assert least_of(pair.astype(int), one, other).tolist() == first.tolist()


def test_one_that_drives_up_to_another_closes_the_gap():
    found = found_in(rows_of(*driven((0, 0, 15, 0), (40, 0.5, 10, 0), seconds=6)))
    assert found.kinds == ["rear-end"]
    assert (found.first[0], found.second[0]) == (1, 0)  # the one ahead is first
    assert found.value[TTC] == pytest.approx([(40 - 4 - 6 * 5) / 5], abs=1e-9)  # least at the end
    assert np.isnan(found.value[PET]).all()
    assert found.xy[TTC, 0] == pytest.approx([2 + 15 * (6 + 1.2), 0.25])  # where the bumpers would meet
    assert found.speed.tolist() == [[10, 15]]


def test_conflicts_of_tracks_that_go_on_are_told_once_when_they_are_over():
    """In blocks of a second: the same as at the end, and nothing twice."""
    rows = rows_of(*driven((0, 0, 10, 0), (30, -60, 0, 12), (0, 50, 15, 0), (40, 50.5, 10, 0), seconds=20))
    whole, meeting, told = found_in(rows), Meeting(), []
    for second in range(20):
        meeting.add(rows.only((rows.t >= second) & (rows.t < second + 1)))
        found = meeting.settled(second + 1)
        told += [(one, other, kind, t) for one, other, kind, t in listed(found) if second + 1 - t >= 5.0]
    late = whole.t < 10  # the others may still go on
    assert sorted(told) == sorted(one for one, over in zip(listed(whole), late, strict=True) if over)
    assert told


def test_who_comes_close_again_later_is_told_again():
    """Though the two were closer before: 0.4 s, and 0.8 s when they come round again 13 s later."""
    track, t, xy, v = driven((-24, 0, 10, 0), (0, -33, 0, 10), seconds=5)
    later = xy + np.where(track[:, None] == 1, [0.0, -4.0], [0.0, 0.0])
    rows = rows_of(np.tile(track, 2), np.append(t, t + 13), np.vstack([xy, later]), np.vstack([v, v]), width=1.0)
    meeting, told = Meeting(), []
    for second in range(40):
        meeting.add(rows.only((rows.t >= second) & (rows.t < second + 1)))
        told += meeting.settled(second + 1).value[PET].tolist()
    assert told == pytest.approx([0.4, 0.8], abs=0.02)
    assert found_in(rows).value[PET] == pytest.approx([0.4], abs=0.02)


def test_what_may_be_nothing_is_told_neither_at_once_nor_at_the_end():
    rows = rows_of(*driven((-24, 0, 10, 0), (0, -31, 0, 10), seconds=5), width=1.0, sigma=0.9)
    meeting = Meeting()
    meeting.add(rows)
    assert np.isnan(meeting.settled(np.inf).value[PET]).all()
    assert np.isnan(found_in(rows).value[PET]).all()


def listed(found):
    return list(zip(found.first.tolist(), found.second.tolist(), found.kinds, found.t.tolist(), strict=True))


def test_one_that_crosses_behind_another_comes_after_it_has_left():
    found = found_in(rows_of(*driven((0, 0, 10, 0), (30, -60, 0, 12))))
    # it leaves x = 31 with its rear at 33 / 10 s; the other one has its front at y = -1 after 57 / 12 s
    assert found.kinds == ["crossing"]
    assert (found.first[0], found.second[0]) == (0, 1)
    assert found.value[PET] == pytest.approx([57 / 12 - 33 / 10])
    assert found.t == pytest.approx([57 / 12], abs=0.04)
    assert np.degrees(found.angle) == pytest.approx([90])
    assert np.abs(found.xy[PET, 0] - [30, 0]).max() <= 1.5


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ((0, 0, 10, 0), (0, 4, 10, 0)),  # side by side
        ((0, 0, 10, 0), (60, 3, -10, 0)),  # past each other
        ((0, 0, 10, 0), (-30, 0, 10, 0)),  # behind, as fast
        ((0, 0, 10, 0), (60, -60, 0, 5)),  # crosses 5.6 s later
    ],
)
def test_who_only_comes_near_is_in_no_conflict(one, other):
    assert len(found_in(rows_of(*driven(one, other, seconds=15)))) == 0


def test_vehicles_that_stand_do_not_collide_by_the_error_of_their_speed():
    track, t, xy, v = driven((0, 0, 0.3, 0), (4.5, 0, 0, 0), seconds=1)
    heading = np.zeros(len(t))
    assert len(found_in(rows_of(track, t, xy, v, heading=heading, speed_sigma=0.2))) == 0
    assert len(found_in(rows_of(track, t, xy, v, heading=heading, speed_sigma=0.01))) == 1


def test_two_in_one_place_at_one_time_have_no_encroachment():
    found = found_in(rows_of(*driven((0, 0, 10, 0), (30, -30, 0, 10))))
    assert np.isnan(found.value[PET]).all()


def test_a_vehicle_is_in_no_conflict_with_itself():
    rows = rows_of(*driven((0, 0, 15, 0), (40, 0, 10, 0), seconds=6))
    assert len(found_in(rows, vehicle=np.zeros(2, int))) == 0


bodies = st.tuples(*[st.floats(-15, 15)] * 4, st.floats(0, 6.3), st.floats(2, 12), st.floats(1, 2.5))


@settings(max_examples=60, deadline=None)
@given(st.lists(bodies, min_size=2, max_size=6), st.integers(1, 7))
def test_times_to_collision_are_those_of_brute_force(drawn, block):
    x, y, vx, vy, heading, length, width = np.array(drawn).T
    count = len(x)
    rows = rows_of(
        *(np.arange(count), np.zeros(count), np.column_stack([x, y]), np.column_stack([vx, vy])),
        *(length, width, heading),
    )
    found = found_in(rows, block)
    ours = {(min(pair), max(pair)): ttc for *pair, ttc in zip(found.first, found.second, found.value[TTC], strict=True)}
    base = footprints(rows.xy, heading, length, width)
    i, j = np.triu_indices(count, 1)
    times = time_to_collision(base[i], base[j], rows.v[j] - rows.v[i])
    apart = ~touching(base[i], base[j], 1e-6)
    near = (times < 1.5 - 1e-6) & apart
    for a, b in zip(i[near], j[near], strict=True):
        assert (a, b) in ours
    for (a, b), ttc in ours.items():
        if not np.isnan(ttc):
            (at,) = np.flatnonzero((i == a) & (j == b))
            assert ttc == pytest.approx(times[at], abs=1e-6)


def curved(rng, count, fps):
    """Vehicles on wide circles through the middle of a junction, from directions that stay apart."""
    parts = []
    for track in range(count):
        speed, start, turn = rng.uniform(4, 14), track * 2 * np.pi / count, rng.uniform(-0.03, 0.03)
        t = np.arange(round(rng.uniform(0, 3) * fps), round(rng.uniform(6, 9) * fps)) / fps
        heading = start + turn * (t - 4.5)
        v = speed * np.column_stack([np.cos(heading), np.sin(heading)])
        xy = np.cumsum(v, axis=0) / fps
        xy += rng.uniform(-6, 6, 2) - xy[len(xy) // 2]
        parts.append((np.full(len(t), track), t, xy, v))
    return [np.concatenate(column) for column in zip(*parts, strict=True)]


@settings(max_examples=8, deadline=None)
@example(seed=239, block=30)  # a time of 4.87 s, between rows that are further apart
@given(seed=st.integers(0, 1000), block=st.integers(30, 400))
def test_post_encroachment_times_are_those_of_brute_force(seed, block):
    fps = 10.0
    track, t, xy, v = curved(np.random.default_rng(seed), 5, fps)
    rows = rows_of(track, t, xy, v, 4.0, 1.8)
    found, whole = found_in(rows, block), found_in(rows)
    assert found.value == pytest.approx(whole.value, abs=1e-9, nan_ok=True)
    ours = {(min(pair), max(pair)): pet for *pair, pet in zip(found.first, found.second, found.value[PET], strict=True)}
    heading = np.arctan2(rows.v[:, 1], rows.v[:, 0])
    base = footprints(rows.xy, heading, np.full(len(rows), 4.0), np.full(len(rows), 1.8))
    for a in range(5):
        for b in range(a + 1, 5):
            i, j = (k.ravel() for k in np.meshgrid(*(np.flatnonzero(rows.track == one) for one in (a, b))))
            met = np.cos(heading[i] - heading[j]) < np.cos(np.radians(30))
            met &= np.abs(rows.t[i] - rows.t[j]) < 5 + 2 / fps
            i, j = i[met], j[met]
            hit = touching(base[i], base[j])
            sampled = np.abs(rows.t[i] - rows.t[j])[hit].min(initial=np.inf)
            pet = ours.get((a, b), np.nan)
            if 0.5 < sampled < 5:
                assert sampled - 2 / fps - 1e-9 <= pet <= sampled + 1e-9
            elif 0 < sampled < 5:  # a short time may not differ from 0 by what it is off
                assert np.isnan(pet) or sampled - 2 / fps - 1e-9 <= pet <= sampled + 1e-9
            elif 5 <= sampled < np.inf:  # between rows it may be below 5 s
                assert np.isnan(pet) or sampled - 2 / fps - 1e-9 <= pet < 5
            else:  # in one place at one time, an error; or never
                assert np.isnan(pet)


def test_the_finer_the_rows_the_same_the_post_encroachment_time():
    """Between rows vehicles go straight on: 5 frames/s give what 100 do."""
    ways = (0, 0, 9.3, 0), (21, -57, 2.1, 11.7)
    coarse, fine = (found_in(rows_of(*driven(*ways, fps=fps))).value[PET] for fps in (5.0, 100.0))
    assert len(coarse) == 1
    assert coarse == pytest.approx(fine, abs=1e-6)


@pytest.mark.parametrize("kind", [TTC, PET])
def test_sigmas_are_what_repetition_with_errors_gives(kind):
    rng = np.random.default_rng(1)
    ways = np.array([(0, 0, 10, 0), (20, -65, 3, 12)] if kind == PET else [(0, 0, 15, 0), (39, 0.5, 10, 0.2)], float)
    errors = {"sigma": 0.3, "speed_sigma": 0.2 if kind == TTC else 0.0, "length_sigma": 0.2}
    seconds = 8.0 if kind == PET else 6.0
    known = found_in(rows_of(*driven(*ways, seconds=seconds), **errors)).sigma[kind]
    values = []
    for _ in range(300):
        track, t, xy, v = driven(*ways, seconds=seconds)
        xy = xy + (errors["sigma"] * rng.standard_normal((2, 2)))[track]
        v = v + (errors["speed_sigma"] * rng.standard_normal((2, 2)))[track]
        length = (4 + errors["length_sigma"] * rng.standard_normal(2))[track]
        last = t > seconds - 1e-9 if kind == TTC else t >= 0
        rows = rows_of(track[last], t[last], xy[last], v[last], length[last], length[last] / 2, np.arctan2(
            ways[track, 3], ways[track, 2])[last])  # fmt: skip
        values.extend(found_in(rows).value[kind])
    assert known == pytest.approx([np.std(values)], rel=0.15)


def test_conflicts_of_a_simulated_junction_are_the_exact_ones():
    clip = simulate_road("junction-3d", seed=0, size=(640, 360), seconds=37, fps=1)
    moved = motion(clip)
    length, width = clip.fleet.length, clip.fleet.width
    true = list(exact_conflicts(moved.time, moved.xy, moved.speed, moved.heading, length, width))
    k, who = np.nonzero(np.isfinite(moved.speed))
    heading, speed = moved.heading[k, who], moved.speed[k, who]
    v = speed[:, None] * np.column_stack([np.cos(heading), np.sin(heading)])
    rows = rows_of(who, moved.time[k], moved.xy[k, who], v, length[who], width[who], heading)
    found = found_in(rows, block=3000)
    ours = dict(zip(zip(found.first.tolist(), found.second.tolist(), strict=True), range(len(found)), strict=True))
    assert len(true) >= 3
    assert set(ours) == {(one.first, one.second) for one in true}
    for one in true:
        row = ours[one.first, one.second]
        assert found.t[row] == pytest.approx(one.time_s, abs=0.05 if one.pet_s is None else 0.5)
        if one.pet_s is not None:
            assert -0.081 <= found.value[PET, row] - one.pet_s <= 1e-6
        if one.ttc_s is not None:
            assert found.value[TTC, row] == pytest.approx(one.ttc_s, abs=1e-6)


@pytest.mark.parametrize("kind", ["junction-3d", "roundabout"])
def test_the_blocks_that_rows_come_in_do_not_matter(kind):
    """Who only follows is told by what both drove before and after, in other blocks."""
    clip = simulate_road(kind, seed=103, size=(640, 360), seconds=60, fps=10)
    moved = motion(clip)
    k, who = np.nonzero(np.isfinite(moved.speed))
    heading = moved.heading[k, who]
    v = moved.speed[k, who, None] * np.column_stack([np.cos(heading), np.sin(heading)])
    rows = rows_of(who, moved.time[k], moved.xy[k, who], v, clip.fleet.length[who], clip.fleet.width[who], heading)
    whole = found_in(rows)
    assert len(whole) >= 3
    for block in (100, 700):
        assert listed(found_in(rows, block)) == listed(whole)


def crossing_run(folder, metres):
    t = np.arange(0, 8, 0.04)
    down = np.column_stack([np.full(len(t), 300.0), 20 + 60 * t])
    return write_run(folder, [along(1, t, 100 + 60 * t), (2, t + 2.5, down)], metres=metres, seconds=20)


def test_the_table_has_places_on_the_road_and_in_the_picture(tmp_path):
    found = measured([crossing_run(tmp_path / "run", metres=True)], site(CALIBRATED))
    (row,) = found.tables["conflicts"].to_pylist()
    assert (row["first_track_id"], row["second_track_id"], row["kind"], row["reason"]) == (1, 2, "crossing", "seen")
    leaves, comes = (200 + 20 + 10) / 60, 2.5 + (220 - 20 - 10) / 60  # px: its rear, and the other one's front
    assert row["pet_s"] == pytest.approx(comes - leaves, abs=0.02)
    assert row["pet_time_s"] == pytest.approx(comes, abs=0.05)
    assert [row["pet_x_px"], row["pet_y_px"]] == pytest.approx([300, 240], abs=15)
    assert [row["pet_x_m"], row["pet_y_m"]] == pytest.approx([30, 24], abs=1.5)
    assert row["ttc_s"] is None
    assert row["first_speed_kmh"] == pytest.approx(21.6)
    assert found.report["conflicts"] == 1


def test_without_metres_there_is_no_table_and_the_report_says_so(tmp_path):
    found = measured([crossing_run(tmp_path / "run", metres=False)], site(SITE))
    assert "conflicts" not in found.tables
    assert found.report["conflicts"] is None


@pytest.mark.parametrize("seconds", [0, 1])
def test_nobody_and_one_alone_are_in_no_conflict(tmp_path, seconds):
    tracks = [along(1, np.arange(25) / 25, 100 + 2 * np.arange(25))] if seconds else []
    found = measured([write_run(tmp_path / "run", tracks, metres=True)], site(CALIBRATED))
    assert len(found.tables["conflicts"]) == found.report["conflicts"] == 0


def test_who_slides_along_another_is_closed_up_to_from_behind_if_at_all():
    """Beside each other by their widths: rounding may have it that they touch, but not when."""
    angle = np.arange(100) / 100 * 2 * np.pi + 0.013
    ahead = np.column_stack([np.cos(angle), np.sin(angle)])
    place = 7.3 * ahead + 2.0 * np.column_stack([-ahead[:, 1], ahead[:, 0]])
    xy = np.stack([np.zeros_like(place), place], axis=1).reshape(-1, 2)
    v = np.stack([14.7 * ahead, 4.9 * ahead], axis=1).reshape(-1, 2)
    ttc = found_in(rows_of(np.arange(200), np.repeat(10.0 * np.arange(100), 2), xy, v)).value[TTC]
    assert 0 < len(ttc) < 100
    assert ttc == pytest.approx((7.3 - 4) / 9.8)
