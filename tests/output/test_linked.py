"""Broken tracks joined: what is one object and what is not, what stands in the gaps, when rows are passed on."""

from dataclasses import replace

import numpy as np
import pytest
from synthetic_steps import Kept

import vidtrack as vt
from vidtrack.config.load import load
from vidtrack.errors import ConfigError
from vidtrack.output.linked import Linked, _within
from vidtrack.output.sink import Step
from vidtrack.output.smoothed import Smoothed
from vidtrack.run.live.run import LiveRun
from vidtrack.run.radar import run_plots

MODEL = vt.ConstantVelocity(accel=1.0, speed=4.0, hold_s=0.5, per_size=True)
FPS = 10.0


def drive(k, x, v, y=100.0, size=(40.0, 20.0)):
    """The box of a vehicle in frame k that starts at x [px] and drives v [px/s]."""
    return [x + v * k / FPS - size[0] / 2, y - size[1] / 2, *size]


def steps(count, boxes_of, model=MODEL, smooth=False):
    """Steps of a tracker that gives up after 0.3 s, fed with boxes_of(k) and errors of a pixel."""
    rng = np.random.default_rng(3)
    life = vt.LifeCycle(confirm_hits=1, confirm_window=1, coast_s=0.3, coast_scans=None)
    tracker = vt.Tracker(model, life=life, smooth=smooth)
    for k in range(count):
        boxes = np.array(boxes_of(k), float).reshape(-1, 4) + np.array([1.0, 1.0, 0, 0]) * rng.normal(size=4)
        scan = vt.box_scan(k / FPS, boxes)
        yield Step(k, scan.t, scan, tracker.step(scan), None, None, {})


def linked(made, longest_s=3.0, model=MODEL):
    """The steps that come out, and how late each was."""
    kept, late = Kept(), []
    sink = Linked(kept, motion=model, longest_s=longest_s)
    for step in made:
        sink.step(step)
        late.append(step.index - (kept.steps[-1].index if kept.steps else -1))
    sink.close()
    assert kept.closed
    return kept.steps, late


def ids(made):
    return np.unique(np.concatenate([step.tracks.id for step in made]))


def broken(first=25, again=40):
    """A vehicle that is not seen between two frames, and another far away that is always seen."""
    return lambda k: ([] if first <= k < again else [drive(k, 50, 60)]) + [drive(k, 600, -20, y=400)]


def test_a_gap_is_bridged_under_the_first_id():
    made = list(steps(70, broken()))
    assert len(ids(made)) == 3
    found, _ = linked(made)
    assert ids(found).tolist() == [1, 2]
    for step in found:
        assert step.tracks.id.tolist() == [1, 2], step.index
        left, top, width, height = step.tracks.box[0]
        truth = drive(step.index, 50, 60)
        assert abs(left - truth[0]) < 6
        assert abs(top - truth[1]) < 6
        assert (width, height) == pytest.approx((40, 20), abs=1)
        assert step.tracks.t == step.time_s
    gap = [step.tracks for step in found[25:40]]
    assert all(tracks.status[0] == vt.Status.COASTING and tracks.measurement[0] == -1 for tracks in gap)
    sigma = [float(tracks.xy_cov[0, 0, 0]) for tracks in gap]
    assert np.argmax(sigma) not in (0, len(gap) - 1), "least is known in the middle"
    assert all(np.linalg.eigvalsh(tracks.P[0])[0] > 0 for tracks in gap)


@pytest.mark.parametrize(("jump", "one"), [(0.0, True), (12.0, True), (60.0, False)])
def test_a_link_spans_a_jump_of_a_part_of_the_size_and_no_more(jump, one):
    """A slow vehicle, 40 px long, whose filter is sure of it; the detector goes on with another part of it."""

    def boxes_of(k):
        slow = [] if 40 <= k < 46 else [drive(k, 50 + jump * (k >= 46), 4)]
        return [*slow, drive(k, 1800, -20, y=1000)]

    sure = vt.ConstantVelocity(accel=0.02, speed=1.0, hold_s=0.5, per_size=True)
    made = list(steps(100, boxes_of, sure))
    assert len(ids(made)) == 3
    found, _ = linked(made, model=sure)
    assert len(ids(found)) == (2 if one else 3)


def test_other_rows_and_the_order_of_steps_stay():
    made = list(steps(70, broken()))
    for before, after in zip(made, linked(made)[0], strict=True):
        assert (before.index, before.time_s) == (after.index, after.time_s)
        np.testing.assert_array_equal(before.tracks.x[before.tracks.id == 2], after.tracks.x[after.tracks.id == 2])


def test_the_gap_is_bounded():
    made = list(steps(70, broken(20, 45)))
    assert len(ids(linked(made, 2.0)[0])) == 3
    assert len(ids(linked(made, 3.0)[0])) == 2


@pytest.mark.parametrize(
    "other",
    [
        pytest.param(lambda k: drive(k, 50, 60, size=(80.0, 40.0)), id="of another size"),
        pytest.param(lambda k: drive(k, 490, -60), id="driving the other way"),
        pytest.param(lambda k: drive(k, 250, 60), id="far ahead"),
        pytest.param(lambda k: drive(k, 50, 60, y=170), id="in another lane"),
    ],
)
def test_two_objects_are_not_joined(other):
    made = list(steps(70, lambda k: [drive(k, 50, 60)] if k < 25 else [other(k)] if k >= 40 else []))
    assert len(ids(made)) == 2
    assert len(ids(linked(made)[0])) == 2


def test_each_end_goes_on_with_the_beginning_that_fits_best():
    """Two vehicles in neighbouring lanes pass behind a bridge; one of them brakes a little."""

    def boxes(k):
        return [] if 25 <= k < 35 else [drive(k, 50, 60, y=100), drive(k, 60 - 0.3 * max(0, k - 25), 60, y=130)]

    found, _ = linked(list(steps(60, boxes)))
    assert ids(found).tolist() == [1, 2]
    for step in (found[0], found[-1]):
        assert step.tracks.xy[0, 1] < step.tracks.xy[1, 1]


def test_several_gaps_make_one_track():
    found, _ = linked(list(steps(100, lambda k: [] if k % 30 >= 20 else [drive(k, 50, 60), drive(k, 90, 60, y=300)])))
    assert ids(found).tolist() == [1, 2]
    assert all(len(step.tracks) == 2 for step in found[:-10])


def test_what_nobody_can_go_on_with_is_passed_on():
    def boxes(k):
        return [drive(k, 50, 60)] if k < 10 or k >= 60 else []

    found, late = linked(list(steps(80, boxes)), longest_s=2.0)
    assert [step.index for step in found] == list(range(80))
    assert min(late[40:60]) <= 1


def test_nothing_comes_out_of_nothing():
    found, _ = linked(list(steps(5, lambda k: [])))
    assert [len(step.tracks) for step in found] == [0] * 5


def test_where_it_has_no_effect_it_is_refused(tmp_path):
    settings = load(assignments=["output.link=true"])
    with pytest.raises(ConfigError, match=r"output\.link .* live"):
        LiveRun("0", settings, tmp_path / "out")
    (tmp_path / "plots.csv").write_text("scan,time_s,x_m,y_m\n0,0,1,2\n1,1,2,3\n")
    with pytest.raises(ConfigError, match=r"output\.link .* radar"):
        run_plots(str(tmp_path / "plots.csv"), settings, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_pairs_in_reach_are_found_without_comparing_all_tracks():
    rng = np.random.default_rng(0)
    begins, ends = rng.integers(0, 100, (2, 60)) / 25
    gap = begins - ends[:, None]
    before, after, between = _within(ends, begins, 0.4)
    expected = np.nonzero((gap > 0) & (gap <= 0.4))
    assert np.array_equal([before, after], expected)
    assert np.array_equal(between, gap[expected])


def test_a_linked_track_is_smoothed_on_either_side_of_its_gap():
    """Also where the rows with which the second part began are gone, as those of a track that was long tentative."""
    made = list(steps(70, broken(), smooth=True))
    new = max(ids(made))
    begin = next(step.index for step in made if new in step.tracks.id)
    late = [
        replace(step, tracks=step.tracks.only((step.tracks.id != new) | (step.index >= begin + 3))) for step in made
    ]
    kept = Kept()
    sink = Linked(Smoothed(kept), motion=MODEL, longest_s=3.0)
    for step in late:
        sink.step(step)
    sink.close()

    assert ids(kept.steps).tolist() == [1, 2]
    variance = np.concatenate([np.diagonal(step.tracks.P, axis1=1, axis2=2) for step in kept.steps])
    assert (variance > 0).all()
    last = made[24].tracks
    np.testing.assert_array_equal(kept.steps[24].tracks.x[0], last.x[last.id == 1][0])
    first, before = kept.steps[begin + 3].tracks, made[begin + 3].tracks
    assert np.trace(first.P[0]) < np.trace(before.P[before.id == new][0])
