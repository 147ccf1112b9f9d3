"""Weather and light change the picture in the stated way, and the truth not at all."""

from functools import cache

import numpy as np
import pytest
from click.testing import CliRunner

from vidtrack.cli import cli
from vidtrack.errors import ConfigError
from vidtrack.simulate import simulate

KNOBS = [
    {"weather": "rain"},
    {"weather": "snow"},
    {"weather": "fog"},
    {"light": "low-sun"},
    {"light": "dusk"},
    {"light": "night"},
    {"wet": True},
    {"clock": True},
    {"weather": "rain", "light": "night", "clock": True},
]
FRAME = 70


@cache
def picture(**knobs):
    return simulate("junction", seed=6, noise=0, **knobs).frame(FRAME).astype(int)


def test_the_defaults_change_nothing():
    plain = simulate("junction", seed=6)
    stated = simulate("junction", seed=6, weather="clear", light="day", wet=False, leaves=1.0, clock=False)
    assert (plain.frame(FRAME) == stated.frame(FRAME)).all()
    assert not plain.conditions.below()
    assert not plain.conditions.above(plain.scene, plain.size, 1.0, 6)


@pytest.mark.parametrize("knobs", KNOBS, ids=str)
def test_the_same_seed_gives_the_same_frames_in_any_order(knobs):
    one, two = simulate("junction", seed=6, **knobs), simulate("junction", seed=6, **knobs)
    later, earlier = one.frame(90), one.frame(20)
    assert (earlier == two.frame(20)).all()
    assert (later == two.frame(90)).all()


@pytest.fixture(scope="module")
def clear():
    return simulate("junction", seed=6).truth


@pytest.mark.parametrize("knobs", KNOBS, ids=str)
def test_the_truth_is_that_of_a_clear_day(clear, knobs):
    other = simulate("junction", seed=6, **knobs).truth
    assert (clear.box == other.box).all()
    assert (clear.visibility == other.visibility).all()
    assert (clear.id == other.id).all()


@pytest.mark.parametrize("name", ["crossing", "nine"])
def test_every_scenario_can_have_weather(name):
    for knobs in ({"weather": "rain", "light": "night"}, {"light": "low-sun"}, {"weather": "snow"}):
        clip = simulate(name, seed=1, size=(200, 150), **knobs)
        assert clip.frame(30).shape == (150, 200, 3)


def test_fog_takes_contrast_most_where_it_is_far():
    clear, fog = picture(), picture(weather="fog")
    share = [fog[rows].std() / clear[rows].std() for rows in (slice(0, 40), slice(140, 180))]
    assert share[0] < 0.4
    assert share[0] < 0.6 * share[1]
    assert share[1] < 0.9


def test_night_is_darker_than_dusk_and_dusk_than_day():
    day, dusk, night = (np.median(picture(light=light)) for light in ("day", "dusk", "night"))
    assert night < 0.75 * dusk
    assert dusk < 0.6 * day


@pytest.mark.parametrize("light", ["dusk", "night"])
def test_headlamps_shine_on_the_road_ahead_and_tail_lamps_are_red(light):
    clip = simulate("junction", seed=6, noise=0, light=light)
    actor = clip.scene.targets[1]  # the white car, in mid-picture
    time = np.array([clip.times[FRAME]])
    places = actor.place(np.array([actor.look.headlamps[0], actor.look.tail_lamps[0], (30.0, 0.0)]), time)[0]
    shown = clip.frame(FRAME).astype(int)
    head, tail, ahead = (shown[int(y), int(x)] for x, y in places)
    assert head.min() > 200
    assert tail[2] > tail[0] + 60
    assert ahead.mean() > 1.5 * np.median(shown)


def test_low_light_is_noisy():
    clip = simulate("junction", seed=6, noise=0, light="night")
    still = (slice(0, 30), slice(0, 60))  # grass, far from all lamps
    change = clip.frame(10)[still].astype(int) - clip.frame(11)[still]
    assert change.std() > 1


def test_a_low_sun_throws_long_dark_shadows_and_a_veil():
    day, low = simulate("junction", seed=6), simulate("junction", seed=6, light="low-sun")
    assert np.hypot(*low.scene.sun) > 4 * np.hypot(*day.scene.sun)
    assert low.scene.sun[1] > 0
    assert picture(light="low-sun")[:40].mean() > picture()[:40].mean() + 20


@pytest.mark.parametrize("knobs", [{"wet": True}, {"weather": "rain"}], ids=str)
def test_a_wet_road_is_darker(knobs):
    assert np.median(picture(**knobs)) < 0.95 * np.median(picture())


@pytest.mark.parametrize("weather", ["rain", "snow"])
def test_what_falls_is_elsewhere_in_the_next_frame(weather):
    clip = simulate("junction", seed=6, noise=0, weather=weather)
    grass = (slice(0, 60), slice(0, 60))
    changed = np.abs(clip.frame(30)[grass].astype(int) - clip.frame(31)[grass]).max(axis=2) > 8
    assert 0.005 < changed.mean() < 0.5


def test_leaves_swing_by_the_factor():
    calm, storm = simulate("junction", seed=6).scene, simulate("junction", seed=6, leaves=4).scene
    for one, other in zip(calm.props, storm.props, strict=True):
        assert np.ptp(other.path.xy, axis=0) == pytest.approx(4 * np.ptp(one.path.xy, axis=0))


def test_the_clock_runs_and_stays_in_its_corner():
    clip, plain = simulate("junction", seed=6, clock=True), simulate("junction", seed=6)
    differs = (clip.frame(10) != plain.frame(10)).any(axis=2)
    assert differs[:18].any()
    assert not differs[18:].any()
    with_clock = clip.frame(10)[:18].astype(int) - clip.frame(25)[:18]
    without = plain.frame(10)[:18].astype(int) - plain.frame(25)[:18]
    assert np.abs(with_clock).max() > np.abs(without).max() + 100


@pytest.mark.parametrize(
    ("name", "knobs", "match"),
    [
        ("junction", {"weather": "hail"}, "weather"),
        ("junction", {"light": "noon"}, "light"),
        ("junction", {"leaves": -1.0}, "leaves"),
        ("junction", {"weather": "rain", "wet": True}, "leave wet out"),
        ("junction", {"weather": "fog", "light": "low-sun"}, "hides the sun"),
        ("crossing", {"leaves": 3.0}, "trees"),
    ],
)
def test_conditions_that_are_unknown_or_do_nothing_are_refused(name, knobs, match):
    with pytest.raises(ConfigError, match=match):
        simulate(name, **knobs)


def test_radar_has_no_weather():
    result = CliRunner().invoke(cli, ["simulate", "radar-tws", "--weather", "rain"])
    assert result.exit_code == 2
    assert "--weather does nothing for radar-tws" in result.output
