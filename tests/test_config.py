"""Settings: what is wrong is said at load, and what is printed can be read again."""

from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from settings_tree import places

from vidtrack.config.explain import as_toml
from vidtrack.config.load import load, names, value_of
from vidtrack.config.settings import Settings
from vidtrack.errors import ConfigError

LEAVES = {name: group.model_fields[field] for name, (group, field) in places()}


@pytest.mark.parametrize("name", LEAVES)
def test_every_setting_is_described_and_explained(name):
    description = LEAVES[name].description
    assert description
    assert len(description) > 10
    assert f"# {description}" in as_toml(Settings(), explain=True)
    assert name in set(names())


def test_description_names_the_unit_of_every_time_and_length():
    for name, info in LEAVES.items():
        if name.endswith("_s") and not name.endswith("_m_s"):
            assert info.description.startswith("s;"), name


@pytest.mark.parametrize("explain", [False, True])
def test_printed_settings_load_as_the_same_settings(tmp_path, explain):
    changed = load(
        assignments=[
            "tracker.method=nn",
            "tracker.coast_s=2.5",
            "source.end_s=30",
            "source.mask=mask.png",
            "detector.disturbance.shadow=false",
            ("output.lines", ["north:0,1,2,3", 'a "b":4,5,6,7']),
        ]
    )
    for settings in (Settings(), changed):
        file = tmp_path / "settings.toml"
        file.write_text(as_toml(settings, explain=explain), encoding="utf-8")
        assert load(file) == load(str(file)) == settings


@pytest.mark.parametrize(
    ("assignment", "value"),
    [
        ("tracker.coast_s=2", 2.0),
        ("tracker.coast_s = 0.5", 0.5),
        ("tracker.confirm_hits=5", 5),
        ("tracker.method=nn", "nn"),
        ('tracker.method="nn"', "nn"),
        ("tracker.merged_blobs=false", False),
        ("source.end_s=none", None),
        ("source.end_s=1e2", 100.0),
        ("radar.resampling=none", "none"),
        ("radar.model=none", None),
        ("source.mask=a b/mask.png", Path("a b/mask.png")),
        ("detector.disturbance.majority_px=9", 9),
        ('output.lines=["a:1,2,3,4"]', ("a:1,2,3,4",)),
        ("output.lines=[]", ()),
    ],
)
def test_values_of_every_kind_are_set(assignment, value):
    assert value_of(load(assignments=[assignment]), assignment.partition("=")[0].strip()) == value


def test_later_ones_win(tmp_path):
    file = tmp_path / "settings.toml"
    file.write_text("[tracker]\ncoast_s = 3.0\naccel = 5.0\n")
    settings = load(file, ["tracker.coast_s=4", "tracker.coast_s=5"])
    assert settings.tracker.coast_s == 5.0
    assert settings.tracker.accel == 5.0
    assert settings.tracker.cross == Settings().tracker.cross


@pytest.mark.parametrize(
    ("wrong", "nearest"),
    [
        ("tracker.coast", "tracker.coast_s"),
        ("tracker.gate_probabilty", "tracker.gate_probability"),
        ("tracker.Method", "tracker.method"),
        ("traker.method", "tracker"),
        ("detector.disturbance.shadows", "detector.disturbance.shadow"),
        ("coast_s", "tracker.coast_s"),
    ],
)
def test_an_unknown_key_names_the_nearest(wrong, nearest, tmp_path):
    with pytest.raises(ConfigError) as caught:
        load(assignments=[(wrong, 1)])
    assert wrong.split(".")[0] in str(caught.value)
    assert nearest in str(caught.value)


@pytest.mark.parametrize(
    ("assignment", "words"),
    [
        ("tracker.gate_probability=1.5", ["tracker.gate_probability", "1.5", "less than or equal to 1"]),
        ("tracker.coast_s=-1", ["tracker.coast_s", "-1", "greater than or equal to 0"]),
        ("tracker.method=jumble", ["tracker.method", "jumble", "'nn'", "'gnn'"]),
        ("tracker.confirm_hits=2.5", ["tracker.confirm_hits", "2.5", "integer"]),
        ("tracker.merged_blobs=perhaps", ["tracker.merged_blobs", "perhaps", "boolean"]),
        ("detector.disturbance.majority_px=4", ["majority_px", "4", "odd"]),
        ("source.scale=0", ["source.scale", "greater than 0"]),
        ("tracker.accel=nan", ["tracker.accel", "nan"]),
        ("tracker.coast_s=inf", ["tracker.coast_s", "inf"]),
        ("tracker=3", ["tracker", "3"]),
    ],
)
def test_a_wrong_value_says_what_is_allowed(assignment, words):
    with pytest.raises(ConfigError) as caught:
        load(assignments=[assignment])
    for word in words:
        assert word in str(caught.value)


def test_an_end_before_the_start_is_refused():
    with pytest.raises(ConfigError, match=r"source\.end_s = 2.*source\.start_s = 5"):
        load(assignments=["source.start_s=5", "source.end_s=2"])


def test_more_hits_than_scans_cannot_confirm():
    with pytest.raises(ConfigError, match="confirm_window"):
        load(assignments=["tracker.confirm_hits=5", "tracker.confirm_window=4"])


def test_all_mistakes_are_told_at_once():
    with pytest.raises(ConfigError) as caught:
        load(assignments=["tracker.coast_s=-1", "tracker.acel=2"])
    assert "tracker.coast_s" in str(caught.value)
    assert "tracker.accel" in str(caught.value)


@pytest.mark.parametrize("assignment", ["tracker.coast_s", "=3", "  =3"])
def test_an_assignment_without_name_or_value_says_how_to_write_it(assignment):
    with pytest.raises(ConfigError, match=r"group\.name=value"):
        load(assignments=[assignment])


def test_a_value_is_not_a_group(tmp_path):
    file = tmp_path / "settings.toml"
    file.write_text("tracker = 3\n")
    with pytest.raises(ConfigError, match="tracker"):
        load(file, ["tracker.coast_s=1"])


@pytest.mark.parametrize("content", [b"[tracker\ncoast_s = 1", b"tracker.coast_s = ", b"a = 1\na = 2", b"\xff\xfe\x00"])
def test_a_file_that_is_not_toml_is_named(tmp_path, content):
    file = tmp_path / "settings.toml"
    file.write_bytes(content)
    with pytest.raises(ConfigError, match=r"settings\.toml is not valid TOML"):
        load(file)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(ConfigError, match=r"nowhere\.toml"):
        load(tmp_path / "nowhere.toml")
    with pytest.raises(ConfigError, match="cannot read"):
        load(tmp_path)


@given(st.text(max_size=30), st.text(max_size=30))
def test_whatever_is_typed_is_a_setting_or_a_config_error(name, value):
    with suppress(ConfigError):
        assert isinstance(load(assignments=[f"tracker.{name}={value}"]), Settings)


def test_settings_cannot_be_changed():
    with pytest.raises(ValueError, match="frozen"):
        Settings().tracker.coast_s = 3.0


def test_a_value_for_a_group_is_refused_in_plain_words():
    with pytest.raises(ConfigError, match=r"tracker = 5: this is a group"):
        load(assignments=["tracker=5"])


def test_any_path_survives_the_way_through_a_file(tmp_path):
    settings = load(assignments=[("source.mask", "Größe 😀.png")])
    (tmp_path / "settings.toml").write_text(as_toml(settings), encoding="utf-8")
    assert load(tmp_path / "settings.toml") == settings


def test_what_is_assigned_stays_out_of_the_settings_that_it_overrides():
    """They are those of the next camera too."""
    base = {"live": {"retry_first": True}}
    assert not load(assignments=["live.retry_first=false"], base=base).live.retry_first
    assert base == {"live": {"retry_first": True}}
