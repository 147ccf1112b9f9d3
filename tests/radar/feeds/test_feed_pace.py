"""Scans from the turns of the antenna, or from time."""

import numpy as np
import pytest

from vidtrack.radar.feeds.messages import Kind, Message, Messages
from vidtrack.radar.feeds.pace import Rounds, Turns, is_unknown, pace_of, turn_within

TURN_S = 4.7


def swept(rng, turns=20, per_turn=15, marks=(0.0,), jitter_s=0.0, stated=float("nan"), known=1.0):
    """Messages of an antenna, in order of time, and the true turn of each."""
    found = []
    for turn in range(turns):
        for mark in marks:
            if rng.random() < known:
                found.append(((turn + mark) * TURN_S, turn, Kind.MARK, stated, 2 * np.pi * mark))
        for part in rng.random(per_turn):
            found.append(((turn + part) * TURN_S + rng.normal(0, jitter_s), turn, Kind.POLAR, 1000, 2 * np.pi * part))
    found.sort()
    return Messages.of([Message(kind, 0, 48, time, u, v) for time, _, kind, u, v in found]), [
        turn for _, turn, *_ in found
    ]


def scans(messages, scan_s=None):
    pace = pace_of(messages, scan_s)
    scan = np.floor(pace.progress(messages)).astype(int)
    return pace, scan - scan[0]


@pytest.mark.parametrize(
    "how",
    [
        {"stated": TURN_S},
        {},
        {"marks": (0.0, 0.25, 0.5, 0.75)},
        {"marks": ()},
        {"known": 0.7},
        {"marks": (), "jitter_s": 0.05},
        {"jitter_s": 0.05},
    ],
)
def test_every_message_is_in_the_turn_that_saw_it(how):
    messages, turn = swept(np.random.default_rng(1), **how)
    pace, scan = scans(messages)
    assert isinstance(pace, Turns)
    assert pace.period_s == pytest.approx(TURN_S, rel=0.02)
    assert (scan == np.array(turn) - turn[0]).all()


@pytest.mark.parametrize("turn_s", [15.0, 25.0, 60.0, 85.0])
def test_slow_turns_are_found_from_azimuths_and_times(turn_s):
    messages, turn = swept(np.random.default_rng(1), marks=())
    messages.time_s[:] *= turn_s / TURN_S
    messages.u[:] = np.random.default_rng(2).uniform(2e3, 6e4, len(messages))
    pace, scan = scans(messages)
    assert pace.period_s == pytest.approx(turn_s, rel=0.02)
    assert (scan == np.array(turn) - turn[0]).all()


@pytest.mark.parametrize("turns", [0.4, 1.0, 4.0])
def test_a_target_round_the_radar_is_no_slow_antenna(turns):
    rng = np.random.default_rng(3)
    part = np.sort(rng.uniform(0, turns, 200))
    found = [Message(Kind.POLAR, 0, 48, 60 * one, 300 + rng.normal(0, 3), 2 * np.pi * one) for one in part]
    pace, _ = scans(Messages.of(found))
    assert isinstance(pace, Rounds)
    assert is_unknown(pace, Messages.of(found)) is (turns >= 1)


def test_a_radar_that_stares_in_one_direction_is_not_asked_for_its_turns():
    rng = np.random.default_rng(0)
    azimuth = np.radians(40 + rng.normal(0, 0.3, 200))
    plots = Messages.of([Message(Kind.POLAR, 0, 48, 0.1 * k, 5000 + 3 * k, v) for k, v in enumerate(azimuth)])
    assert not is_unknown(pace_of(plots, None), plots)


@pytest.mark.parametrize("coarse_s", [0.1, 1.0, 2.0])
def test_turns_are_found_where_several_plots_share_a_rounded_time(coarse_s):
    messages, turn = swept(np.random.default_rng(1), marks=())
    messages.u[:] = np.random.default_rng(2).uniform(2e3, 6e4, len(messages))
    messages.time_s[:] = np.floor(messages.time_s / coarse_s) * coarse_s
    pace = pace_of(messages, None, coarse_s)
    scan = np.floor(pace.progress(messages)).astype(int)
    assert isinstance(pace, Turns)
    assert (scan - scan[0] == np.array(turn) - turn[0]).all()


def of_times(rng, time_s, half_deg):
    """Plots (N,) at times (N,) in a sector about east, and the tenth percentile of the steps between their times."""
    place = rng.uniform(3e3, 1.1e4, len(time_s)), np.radians(90 + rng.uniform(-half_deg, half_deg, len(time_s)))
    plots = Messages.of([Message(Kind.POLAR, 0, 48, *one) for one in zip(time_s, *place, strict=True)])
    return plots, float(np.quantile(np.diff(np.unique(time_s)), 0.1))


@pytest.mark.parametrize(("on_s", "every_s", "bursts"), [(10, 60, 4), (5, 30, 8), (10, 40, 6), (8, 30, 6)])
def test_scans_in_bursts_in_a_sector_are_no_antenna(on_s, every_s, bursts):
    for seed in range(20):
        rng = np.random.default_rng(seed)
        scans_s = np.concatenate([every_s * k + np.arange(on_s) for k in range(bursts)])
        plots, step_s = of_times(rng, np.repeat(scans_s, rng.integers(4, 11)).astype(float), half_deg=20)
        assert isinstance(pace_of(plots, None, step_s), Rounds)
        assert turn_within(plots, step_s) is None


def test_scans_at_irregular_times_in_a_sector_are_no_antenna():
    for seed in range(300):
        rng = np.random.default_rng(seed)
        plots, step_s = of_times(rng, np.repeat(rng.uniform(0.5, 8, 40).cumsum(), 6), half_deg=30)
        assert isinstance(pace_of(plots, None, step_s), Rounds)
        assert turn_within(plots, step_s) is None


@pytest.mark.parametrize("turned", [0.1, 0.2, 0.3, 0.5, 1.0])
def test_a_second_of_a_sweep_backwards_has_no_turns_of_negative_duration(turned):
    rng = np.random.default_rng(0)
    swept = np.sort(rng.uniform(0, 1, 400))
    place = rng.uniform(3e3, 6e4, 400), -2 * np.pi * turned * swept
    plots = Messages.of([Message(Kind.POLAR, 0, 48, *one) for one in zip(swept.round(2), *place, strict=True)])
    assert pace_of(plots, None, 0.01).period_s > 0


def test_turns_are_found_from_plots_in_a_sector():
    messages, turn = swept(np.random.default_rng(1), marks=())
    messages.u[:] = np.random.default_rng(2).uniform(2e3, 6e4, len(messages))
    messages = messages.only(kept := np.abs(messages.v - np.pi / 2) < np.radians(45))
    messages.time_s[:] = np.floor(messages.time_s / 0.5) * 0.5
    pace = pace_of(messages, None, 0.5)
    scan = np.floor(pace.progress(messages)).astype(int)
    assert pace.period_s == pytest.approx(TURN_S, rel=0.02)
    assert (scan - scan[0] == np.array(turn)[kept] - np.array(turn)[kept][0]).all()


def test_scattered_azimuths_do_not_turn_the_antenna():
    rng = np.random.default_rng(2)
    messages, turn = swept(rng, turns=60, marks=())
    false = rng.random(len(messages)) < 0.1
    messages.v[false] = rng.uniform(0, 2 * np.pi, int(false.sum()))
    _, scan = scans(messages)
    assert (scan[~false] - np.array(turn)[~false] == scan[~false][0] - turn[int(np.argmin(false))]).all()


def test_plots_of_one_time_are_of_the_scan_of_their_mark():
    rng = np.random.default_rng(3)
    found = []
    for turn in range(12):
        found.append(Message(Kind.MARK, 0, 34, turn * 4.0, 4.0, 0.0))
        found += [Message(Kind.POLAR, 0, 48, turn * 4.0 + 0.01, 1000, v) for v in rng.uniform(0, 2 * np.pi, 8)]
    _, scan = scans(Messages.of(found))
    assert (scan == np.repeat(np.arange(12), 9)).all()


def test_without_an_antenna_plots_of_one_time_are_a_scan():
    rng = np.random.default_rng(4)
    found = [
        Message(Kind.POLAR, 0, 48, turn * 2.5, 1000, v) for turn in range(12) if turn != 6 for v in rng.uniform(0, 6, 8)
    ]
    pace, scan = scans(Messages.of(found))
    assert isinstance(pace, Rounds)
    assert np.unique(scan).tolist() == [0, 1, 2, 3, 4, 5, 7, 8, 9, 10, 11]


def test_a_round_is_as_long_as_nine_of_ten_targets_need():
    found = [
        Message(Kind.GEODETIC, 0, 0, time, 50.0, 5.0 + target, target=target)
        for target in range(20)
        for time in np.arange(0, 100, 10 if target else 3) + 0.1 * target
    ]
    pace, _ = scans(Messages.of(sorted(found, key=lambda message: message.clock_s)))
    assert pace.period_s == pytest.approx(10)


def test_the_duration_can_be_given():
    messages, _ = swept(np.random.default_rng(5), marks=())
    messages.v[:] = 0.0
    assert scans(messages, scan_s=2.0)[0].period_s == 2.0
