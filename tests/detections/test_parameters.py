"""What stored detections tell of their detector."""

import numpy as np
import pytest

from vidtrack.detections.parameters import LEAST_ACCEL, MARGIN, PACE, SELDOM, Chains, estimate_parameters, natural_rate

FPS, HOLD_S = 10.0, 0.5
FINE = 10  # steps of the simulated motion in a frame


def walkers(count, frames, rng, jitter=0.05, accel=1.0, size=40.0):
    """Frames (N,) and boxes (N, 4) of objects far apart, with white accelerations and independent errors."""
    dt = 1 / (FINE * FPS)
    noise = accel * np.sqrt(HOLD_S * dt) * size * rng.standard_normal((FINE * frames, count, 2))
    position = np.cumsum(np.cumsum(noise, axis=0) * dt, axis=0)[::FINE] + 1e5 * np.arange(count)[:, None]
    centre = position + jitter * size * rng.standard_normal(position.shape)
    box = np.concatenate([centre - [size / 4, size / 2], np.broadcast_to([size / 2, size], centre.shape)], axis=2)
    return np.repeat(np.arange(frames), count), box.reshape(-1, 4)


def strays(count, frames, rng):
    """Boxes of no object, never twice in one place."""
    box = np.column_stack([rng.uniform(-1e6, 0, (count, 2)), np.full((count, 2), 30.0)])
    return rng.integers(frames, size=count), box


def sorted_by_frame(frame, *columns):
    order = np.argsort(frame, kind="stable")
    return frame[order], *(column[order] for column in columns)


def estimated(frame, box, ranks):
    """The parameters estimated from the boxes."""
    return estimate_parameters(Chains.of(frame, box, ranks), FPS, HOLD_S)


def rank(score):
    return np.searchsorted(np.sort(score), score, side="right") / len(score)


@pytest.mark.parametrize("share", [0.1, 0.5, 0.8])
def test_scores_are_trusted_from_where_boxes_are_found_again(share):
    rng = np.random.default_rng(1)
    frame, box = walkers(10, 100, rng)
    false = int(len(frame) * share / (1 - share))
    stray_frame, stray = strays(false, 100, rng)
    score = np.concatenate([rng.uniform(0.5, 1, len(frame)), rng.uniform(0, 0.5, false)])
    mixed = sorted_by_frame(np.concatenate([frame, stray_frame]), np.concatenate([box, stray]), rank(score))
    sure = estimated(*mixed).sure_score
    assert share - 0.02 <= sure <= share + SELDOM * (1 - share) + 0.02, "few of those that move may score less"


def test_all_scores_are_trusted_where_they_tell_nothing():
    rng = np.random.default_rng(2)
    frame, box = walkers(10, 100, rng)
    assert estimated(frame, box, rank(rng.random(len(frame)))).sure_score < 0.2
    assert estimated(frame, box, np.ones(len(frame))).sure_score == 1.0
    one_frame = frame[:10] * 0, box[:10], rank(np.arange(10.0))
    assert estimated(*one_frame).sure_score == 0.1


@pytest.mark.parametrize(("jitter", "accel"), [(0.05, 1.0), (0.02, 3.0), (0.08, 0.5)])
def test_jitter_and_acceleration_are_told_apart(jitter, accel):
    frame, box = walkers(20, 200, np.random.default_rng(3), jitter, accel)
    found = estimated(frame, box, np.ones(len(frame)))
    assert found.jitter == pytest.approx(MARGIN * jitter, rel=0.15)
    assert found.accel == pytest.approx(MARGIN * accel, rel=0.15)


def test_what_stands_still_is_given_a_least_acceleration():
    frame, box = walkers(5, 50, np.random.default_rng(4), jitter=0.0, accel=0.0)
    found = estimated(frame, box, np.ones(len(frame)))
    assert (found.jitter, found.accel) == (pytest.approx(0.0, abs=1e-5), LEAST_ACCEL)


def test_a_short_file_does_not_tell():
    frame, box = walkers(2, 5, np.random.default_rng(5))
    found = estimated(frame, box, np.ones(len(frame)))
    assert (found.jitter, found.accel) == (None, None)


def test_boxes_without_size_are_like_nothing():
    frame = np.arange(100)
    found = estimated(frame, np.zeros((100, 4)), np.ones(100))
    assert (found.sure_score, found.jitter, found.accel) == (1.0, None, None)


def test_what_never_moves_is_trusted_only_with_the_scores_of_what_moves():
    """A lamp post that is taken for a person in every frame is found again as surely as one."""
    rng = np.random.default_rng(6)
    frame, box = walkers(10, 100, rng)
    posts = np.tile([[5e6, 0.0, 20.0, 40.0], [5e6, 300.0, 20.0, 40.0]], (100, 1))
    score = np.concatenate([rng.uniform(0.5, 1, len(frame)), rng.uniform(0, 0.4, len(posts))])
    both = sorted_by_frame(
        np.concatenate([frame, np.repeat(np.arange(100), 2)]), np.concatenate([box, posts]), rank(score)
    )
    share = len(posts) / len(score)
    assert share <= estimated(*both).sure_score <= share + SELDOM + 0.02


@pytest.mark.parametrize("step", [0.04, 0.12, 0.2])
def test_the_natural_rate_is_that_at_which_movers_go_their_pace(step):
    """Most stand still, as cars at the lights do, and say nothing."""
    frame = np.repeat(np.arange(60), 5)
    x = np.concatenate([[40.0 * step * k, 500.0, 1000.0, 1500.0, 2000.0] for k in range(60)])
    box = np.column_stack([x, np.tile(200.0 * np.arange(5), 60), np.full((300, 2), [20.0, 40.0])])
    assert natural_rate(Chains.of(frame, box, np.ones(300))) == pytest.approx(PACE / step)


def test_where_nothing_moves_there_is_no_natural_rate():
    frame = np.repeat(np.arange(60), 2)
    box = np.tile([[0.0, 0.0, 20.0, 40.0], [300.0, 0.0, 20.0, 40.0]], (60, 1))
    assert natural_rate(Chains.of(frame, box, np.ones(120))) is None
