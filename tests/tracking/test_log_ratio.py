"""Confirmation and deletion by the score, and what M of N is worth, by their numbers."""

import numpy as np
import pytest

import vidtrack as vt
from vidtrack.associate.gate import Gate
from vidtrack.tracking.lifecycle import confirmation_probability, scans_to_false_deletion

QUIET = vt.ConstantVelocity(dim=1, accel=0.1, speed=0.5)
FIELD = 1000.0


def scan(t, *z):
    return vt.Scan(t, np.array(z, float).reshape(-1, 1), np.eye(1))


def tracker(life, detection=0.9, clutter=1e-3, **more):
    return vt.Tracker(
        QUIET, gate=Gate(0.999), life=life, detection_probability=detection, clutter_density=clutter, **more
    )


def test_the_score_is_the_sum_of_its_parts():
    followed = tracker(vt.LogRatio(new_share=0.2, false_track=1e-6))
    followed.step(scan(0.0, 500.0))
    score = np.log(0.2)
    for k in range(1, 4):
        ahead = followed.predict(float(k))
        S = ahead.xy_cov[0, 0, 0] + 1
        v = 500.5 - ahead.xy[0, 0]
        score += np.log(0.9) - 0.5 * (v * v / S + np.log(2 * np.pi * S)) - np.log(1e-3)
        followed.step(scan(float(k), 500.5))
        assert followed.register.score[0] == pytest.approx(score, abs=1e-9)
    followed.step(scan(4.0))
    assert followed.register.score[0] == pytest.approx(score + np.log(1 - 0.9 * 0.999), abs=1e-9)


def test_it_is_confirmed_at_its_threshold_and_says_so():
    life = vt.LogRatio(false_track=1e-4, missed_track=1e-2)
    followed, confirmed = tracker(life), []
    for k in range(8):
        tracks = followed.step(scan(float(k), 500.0))
        confirmed.append(bool(tracks.status[0] == vt.Status.CONFIRMED))
        assert confirmed[-1] == (followed.register.score[0] >= np.log(0.99 / 1e-4))
        for event in tracks.events:
            if event.kind == "confirmed":
                assert event.reason == "score of 9.20 reached"
    assert not confirmed[1]
    assert confirmed[-1]


@pytest.mark.parametrize(("detection", "missed", "lives"), [(0.9, 1e-4, 5), (0.7, 1e-4, 8), (0.7, 1e-2, 4)])
def test_a_confirmed_track_ends_when_its_score_has_dropped_far_enough(detection, missed, lives):
    """Each miss costs ln(1 - P_D P_G): the number of misses follows from P_D."""
    life = vt.LogRatio(missed_track=missed)
    assert lives == np.ceil(life.drop / -np.log(1 - detection * 0.999))
    followed = tracker(life, detection)
    for k in range(12):
        followed.step(scan(float(k), 500.0))
    alive = [len(followed.step(scan(12.0 + k))) for k in range(12)]
    assert sum(alive) == lives - 1


def test_clutter_is_confirmed_and_targets_are_dropped_as_rarely_as_asked():
    """Many tracks that begin at once: of clutter, and of targets. Wald's bounds are met."""
    rng = np.random.default_rng(1)
    runs, detection, clutter = 4000, 0.8, 0.02
    life = vt.LogRatio(false_track=0.01, missed_track=0.01)
    for real in (False, True):
        followed = tracker(life, detection, clutter, births=True)
        followed.step(vt.Scan(0.0, np.zeros((runs, 1)), np.eye(1), run=np.arange(runs)))
        followed.births = False
        confirmed = np.zeros(runs, bool)
        for k in range(1, 25):
            run = [np.flatnonzero(rng.random(runs) < detection)] if real else []
            z = [rng.normal(size=len(run[0]))] if real else []
            false = np.repeat(np.arange(runs), rng.poisson(clutter * 40, runs))
            run.append(false)
            z.append(rng.uniform(-20, 20, len(false)))
            z, run = np.concatenate(z), np.concatenate(run)
            tracks = followed.step(vt.Scan(float(k), z[:, None], np.eye(1), run=run))
            confirmed[tracks.run[tracks.status != vt.Status.TENTATIVE]] = True
        if real:
            assert confirmed.mean() > 0.97
        else:
            assert confirmed.mean() < 0.01


@pytest.mark.parametrize("detection", [0.0, 1.0])
@pytest.mark.parametrize("clutter", [0.0, 1e-3])
@pytest.mark.parametrize("method", [vt.GNN, vt.JPDA, vt.MHT])
def test_limits(detection, clutter, method):
    followed = tracker(vt.LogRatio(), detection, clutter, associate=method())
    for k in range(40):
        tracks = followed.step(scan(float(k), *([500.0] if k < 10 else [])))
        assert np.isfinite(followed.register.score).all()
    assert len(tracks) == 0


@pytest.mark.parametrize("life", ["m-of-n", "llr"])
def test_settings_name_the_rule(life):
    from vidtrack.config.settings import Settings
    from vidtrack.run.trackers import build_blob_tracker

    settings = Settings.model_validate({"tracker": {"life": life, "false_track": 1e-5, "confirm_hits": 2}})
    found = build_blob_tracker(settings.tracker, (320, 240)).life
    if life == "llr":
        assert isinstance(found, vt.LogRatio)
        assert found.false_track == 1e-5
    else:
        assert found.confirm_hits == 2
    assert found.coast_s == settings.tracker.coast_s


@pytest.mark.parametrize(
    "bad",
    [{"false_track": 0.0}, {"missed_track": 0.5}, {"new_share": 0.0}, {"coast_scans": None}, {"coast_scans": 99}],
)
def test_a_test_that_makes_no_sense_is_refused(bad):
    with pytest.raises(vt.ConfigError):
        vt.LogRatio(**bad)


@pytest.mark.parametrize(
    ("p", "hits", "window", "any_window", "initiated"),
    [
        (0.9, 3, 4, 0.9477, 0.972),
        (0.1, 3, 4, 0.0037, 0.028),
        (0.9, 3, 5, 0.99144, 0.9963),
        (0.01, 3, 5, 9.8506e-06, 5.9203e-04),
        (0.7, 2, 3, 0.784, 0.91),
        (0.5, 2, 4, 0.6875, 0.875),
    ],
)
def test_m_of_n_in_both_conventions(p, hits, window, any_window, initiated):
    assert confirmation_probability(p, hits, window, initiated=False) == pytest.approx(any_window, abs=1e-9)
    assert confirmation_probability(p, hits, window) == pytest.approx(initiated, abs=1e-9)


@pytest.mark.parametrize(
    ("misses", "detection", "scans"),
    [(3, 0.9, 1110.0), (3, 0.7, 51.48148148148146), (5, 0.5, 62.0), (3, 0.0, 3.0), (3, 1.0, np.inf)],
)
def test_mean_time_to_a_false_deletion(misses, detection, scans):
    assert scans_to_false_deletion(misses, detection) == pytest.approx(scans, abs=1e-9)


ALL = (vt.NN, vt.GNN, vt.GeneralizedNN, vt.PDA, vt.JPDA, vt.Split, vt.MHT)


@pytest.mark.parametrize("method", ALL)
def test_existence_of_what_is_seen_and_of_what_is_not(method):
    """Five times seen: hardly any doubt. Seen once and missed: rather clutter."""
    followed = tracker(vt.LifeCycle(), associate=method(), clutter=1e-4)
    for k in range(5):
        tracks = followed.step(scan(float(k), 500.0, *([100.0] if k == 4 else [])))
    assert tracks.existence[np.argmin(abs(tracks.xy[:, 0] - 500))] > 0.99
    tracks = followed.step(scan(5.0, 500.0))
    doubtful = abs(tracks.xy[:, 0] - 100) < 5
    assert (tracks.existence[doubtful] < 0.5).all()
