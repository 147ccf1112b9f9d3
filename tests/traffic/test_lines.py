"""Counting lines."""

import logging
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from synthetic_steps import make_tracks

from vidtrack.errors import ConfigError
from vidtrack.traffic.lines import LineCounter, parse_line, parse_lines, segments

GATE = "gate:100,0,100,200"


def count(line, *frames, fps=10.0, close=True):
    """Crossings of tracks given as one list of rows (id, status letter, x, y) per frame; boxes are 20 x 10."""
    counter = LineCounter([parse_line(line)])
    found = []
    for index, rows in enumerate(frames):
        found += counter.step(index, make_tracks(index / fps, rows))
    return found + counter.close() if close else found


def drive(xs, letter="c", track_id=1, y=50.0):
    return [[(track_id, letter, x, y)] for x in xs]


def test_a_crossing_has_interpolated_time_frame_and_direction():
    (crossing,) = count(GATE, *drive([80, 95, 115, 130]))
    assert crossing.time_s == pytest.approx(0.125)
    assert (crossing.frame, crossing.line, crossing.direction, crossing.track_id) == (2, "gate", "right", 1)


@pytest.mark.parametrize(
    ("line", "start", "end", "direction"),
    [
        ("a:100,0,100,200", (80, 50), (120, 50), "right"),
        ("a:100,200,100,0", (80, 50), (120, 50), "right"),
        ("a:100,0,100,200", (120, 50), (80, 50), "left"),
        ("a:0,100,200,100", (50, 80), (50, 120), "down"),
        ("a:200,100,0,100", (50, 80), (50, 120), "down"),
        ("a:0,100,200,100", (50, 120), (50, 80), "up"),
        ("a:0,80,200,120", (100, 120), (100, 80), "up"),
        ("a:80,0,120,200", (80, 100), (120, 100), "right"),
    ],
)
def test_directions_are_those_of_the_picture_however_the_line_was_drawn(line, start, end, direction):
    frames = [[(1, "c", *xy)] for xy in np.linspace(start, end, 7)]
    assert [c.direction for c in count(line, *frames)] == [direction]


def test_jitter_on_the_line_counts_once():
    rng = np.random.default_rng(0)
    standing = 100 + rng.uniform(-2.5, 2.5, 200)
    found = count(GATE, *drive([60, 80, 95, *standing, 110, 130]))
    assert [c.direction for c in found] == ["right"]


def test_a_track_that_stops_on_the_line_and_turns_back_does_not_count():
    assert count(GATE, *drive([60, 80, 98, 101, 99, 102, 99, 90, 70])) == []


def test_a_u_turn_counts_once_in_each_direction_and_never_again():
    there_and_back = [80, 95, 110, 130, 110, 95, 80]
    found = count(GATE, *drive(there_and_back * 3))
    assert [c.direction for c in found] == ["right", "left"]


def test_beyond_the_ends_of_the_segment_nothing_is_counted():
    assert count("gate:100,0,100,40", *drive([80, 95, 110, 130])) == []


def test_a_tentative_track_counts_when_it_is_confirmed_at_the_time_it_crossed():
    frames = drive([80, 95, 115, 130], "t") + drive([140, 150], "c")
    counter = LineCounter([parse_line(GATE)])
    found = [counter.step(k, make_tracks(k / 10, rows)) for k, rows in enumerate(frames)]
    assert [len(f) for f in found] == [0, 0, 0, 0, 1, 0]
    assert (found[4][0].time_s, found[4][0].frame) == (pytest.approx(0.125), 2)


def test_a_track_that_is_never_confirmed_does_not_count():
    assert count(GATE, *drive([80, 95, 115, 130], "t"), []) == []


def test_coasting_over_the_line_counts_if_found_again():
    found = count(GATE, *drive([70, 80]), *drive([90, 110, 120], "o"), *drive([130], "c"))
    assert [(c.time_s, c.frame) for c in found] == [(pytest.approx(0.25), 3)]


def test_coasting_over_the_line_and_dying_does_not_count():
    assert count(GATE, *drive([70, 80]), *drive([90, 110, 120], "o"), [], []) == []


def test_seen_last_just_beyond_the_line_counts_at_death_and_at_the_end():
    assert len(count(GATE, *drive([80, 95, 101]), [], close=False)) == 1
    assert len(count(GATE, *drive([80, 95, 101]))) == 1
    assert len(count(GATE, *drive([80, 95, 101]), [], [])) == 1


def test_merged_tracks_count_each():
    found = count(GATE, *[[(1, "m", x, 50.0), (2, "m", x + 6.0, 50.0)] for x in [80, 90, 100, 110, 120]])
    assert sorted(c.track_id for c in found) == [1, 2]


def test_totals_by_line_and_direction():
    counter = LineCounter([parse_line(GATE), parse_line("far:900,0,900,9")])
    for index, rows in enumerate(drive([80, 95, 110, 130])):
        counter.step(index, make_tracks(index / 10, rows))
    assert counter.totals() == {"gate": {"left": 0, "right": 1}, "far": {"left": 0, "right": 0}}


def test_without_lines_nothing_happens():
    counter = LineCounter([])
    assert counter.step(0, make_tracks(0.0, [(1, "c", 0, 0)])) == []
    assert counter.close() == []
    assert counter.totals() == {}


@given(
    st.lists(st.lists(st.floats(-50, 250), min_size=2, max_size=30), min_size=1, max_size=5),
    st.randoms(use_true_random=False),
)
@settings(max_examples=100, deadline=None)
def test_a_track_never_counts_twice_in_a_direction_and_never_without_changing_sides(roads, shuffler):
    """Rows come in any order: the counter goes by identity."""
    frames = []
    for k in range(max(map(len, roads))):
        rows = [(i, "c", xs[k], 50.0) for i, xs in enumerate(roads) if k < len(xs)]
        shuffler.shuffle(rows)
        frames.append(rows)
    found = count(GATE, *frames)
    keys = [(c.track_id, c.direction) for c in found]
    assert len(keys) == len(set(keys))
    for crossing in found:
        xs = roads[crossing.track_id]
        assert any((a < 100) != (b < 100) for a, b in pairwise(xs))
        assert (crossing.frame - 1) / 10 <= crossing.time_s <= crossing.frame / 10


@pytest.mark.parametrize(
    "text", ["", "a", "a:1,2,3", "a:1,2,3,x", ":1,2,3,4", "a:1,2,1,2", "a:0,0,nan,1", "a,b:0,0,1,1", 'a"b:0,0,1,1']
)
def test_a_malformed_line_is_refused_with_its_text(text):
    with pytest.raises(ConfigError, match="line"):
        parse_line(text)


def test_two_lines_of_one_name_are_refused():
    with pytest.raises(ConfigError, match="'a'"):
        parse_lines(["a:0,0,9,9", "a:0,5,9,5"], 10, 10)


def test_a_line_outside_the_picture_is_warned_of(caplog):
    with caplog.at_level(logging.WARNING):
        parse_lines(["in:0,5,9,5", "out:0,50,9,50"], 320, 40)
    assert [record.getMessage().split()[1] for record in caplog.records] == ["out"]


@pytest.mark.parametrize(
    "line", ["out:0,50,9,50", "out:0,-9,9,0", "out:-90,30,30,-90", "out:320,0,400,39", "out:-9,0,0,39"]
)
def test_where_the_size_is_known_a_line_wholly_outside_the_picture_is_refused(line):
    parse_lines(["half:0,20,1979,20", "beyond:-9,-9,400,90", "edge:0,0,0,39"], 320, 40, refuse=True)
    with pytest.raises(ConfigError, match="line out lies outside the 320 x 40 picture: nothing can cross it"):
        parse_lines([line], 320, 40, refuse=True)


@pytest.mark.parametrize("name", ["=cmd|' /C calc'!A0", "+1", "-a", "@SUM(A1)", "\tx"])
def test_a_name_is_no_formula_to_a_spreadsheet(name):
    with pytest.raises(ConfigError, match="formula to spreadsheets"):
        parse_line(f"{name}:0,0,10,10")


def test_counts_go_on_from_earlier_ones():
    counter = LineCounter([parse_line(GATE)])
    counter.resume({"gate": {"left": 3, "right": 4}, "gone": {"up": 9}})
    assert counter.totals() == {"gate": {"left": 3, "right": 4}}


def test_a_line_with_corners_counts_where_it_is_crossed_and_not_beside_it():
    """A corner at (100, 100); vehicles cross the one leg, the other, and none: only where the legs would go on."""
    bent = LineCounter(segments("bend", [(100, 0), (100, 100), (200, 200)]))
    ways = {(80, 50): (120, 50), (80, 160): (180, 140), (90, 80): (140, 190)}
    for number, (start, end) in enumerate(ways.items()):
        for frame, (x, y) in enumerate(np.linspace(start, end, 9)):
            bent.step(frame, make_tracks(frame / 10, [(number, "c", x, y)]))
    assert bent.totals() == {"bend": {"left": 0, "right": 2}}


def test_other_lines_count_from_now_on_and_the_same_ones_go_on():
    """The line at 100 stays while the vehicle is on it; that at 200 goes, and one at 150 comes."""
    stays, goes, comes = (parse_line(f"{name}:{x},0,{x},200") for name, x in (("a", 100), ("b", 200), ("c", 150)))
    counter = LineCounter([goes, stays])
    found = []
    for frame, x in enumerate([60, 80, 99, 101, 120, 140, 160, 180, 220, 240]):
        if frame == 4:
            counter.use([stays, comes])
        found += counter.step(frame, make_tracks(frame / 10, [(1, "c", float(x), 50.0)]))
    assert [(one.line, one.direction, round(one.time_s, 3)) for one in found] == [
        ("a", "right", 0.25),
        ("c", "right", 0.55),
    ]
    assert counter.totals() == {"a": {"left": 0, "right": 1}, "c": {"left": 0, "right": 1}}
