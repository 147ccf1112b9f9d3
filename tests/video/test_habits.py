"""What stored detections tell of their detector."""

import numpy as np
import pytest

from vidtrack.video.habits import LEAST_ACCEL, MARGIN, habits

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
    assert habits(*mixed, FPS, HOLD_S).sure_score == pytest.approx(share, abs=0.02)


def test_all_scores_are_trusted_where_they_tell_nothing():
    rng = np.random.default_rng(2)
    frame, box = walkers(10, 100, rng)
    assert habits(frame, box, rank(rng.random(len(frame))), FPS, HOLD_S).sure_score < 0.2
    assert habits(frame, box, np.ones(len(frame)), FPS, HOLD_S).sure_score == 1.0
    one_frame = frame[:10] * 0, box[:10], rank(np.arange(10.0))
    assert habits(*one_frame, FPS, HOLD_S).sure_score == 0.1


@pytest.mark.parametrize(("jitter", "accel"), [(0.05, 1.0), (0.02, 3.0), (0.08, 0.5)])
def test_jitter_and_acceleration_are_told_apart(jitter, accel):
    frame, box = walkers(20, 200, np.random.default_rng(3), jitter, accel)
    found = habits(frame, box, np.ones(len(frame)), FPS, HOLD_S)
    assert found.jitter == pytest.approx(MARGIN * jitter, rel=0.15)
    assert found.accel == pytest.approx(MARGIN * accel, rel=0.15)


def test_what_stands_still_is_given_a_least_acceleration():
    frame, box = walkers(5, 50, np.random.default_rng(4), jitter=0.0, accel=0.0)
    found = habits(frame, box, np.ones(len(frame)), FPS, HOLD_S)
    assert (found.jitter, found.accel) == (pytest.approx(0.0, abs=1e-5), LEAST_ACCEL)


def test_a_short_file_does_not_tell():
    frame, box = walkers(2, 5, np.random.default_rng(5))
    found = habits(frame, box, np.ones(len(frame)), FPS, HOLD_S)
    assert (found.jitter, found.accel) == (None, None)


def test_boxes_without_size_are_like_nothing():
    frame = np.arange(100)
    found = habits(frame, np.zeros((100, 4)), np.ones(100), FPS, HOLD_S)
    assert (found.sure_score, found.jitter, found.accel) == (1.0, None, None)
