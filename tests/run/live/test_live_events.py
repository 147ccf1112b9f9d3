"""The events of a live run: what is counted is told, once and with its picture, and so is trouble of the camera."""

import csv
import json
import time
from importlib.util import find_spec

import cv2
import numpy as np
import pytest
from cameras import Picture, Script, grey, script_of
from live_runs import NEVER_ROLLS, play, settings
from receivers import HookServer, Listener, Mosquitto, needs_mosquitto

from vidtrack.cli import cli
from vidtrack.config.load import load
from vidtrack.errors import ConfigError
from vidtrack.output.events.event import Event, Kind
from vidtrack.output.events.outbox import Outbox
from vidtrack.recording.event_pictures import EventPictures
from vidtrack.recording.reserve import Reserve
from vidtrack.recording.retention import Limits
from vidtrack.run.live.events import Receivers
from vidtrack.run.live.outputs import LiveExtras
from vidtrack.run.live.run import LiveRun

CORNERS = [[0, 0], [319, 0], [319, 239], [0, 239]]
SITE = f"""
[site]
name = "yard"
width = 320
height = 240
[calibration]
picture = {CORNERS}
ground = {[[x / 8, -y / 8] for x, y in CORNERS]}
[zones.east]
polygon = [[200, 0], [319, 0], [319, 239], [200, 239]]
"""
SECRETS = ("geheim", "sesame", "p@ss")


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    monkeypatch.setattr("vidtrack.run.live.events._LOOK_S", 0.05)
    monkeypatch.setattr("vidtrack.output.events.sender._BACKOFF_S", 0.02)


def of_kind(events, kind):
    return [event for event in events if event["event_type"] == kind]


def crossings(folder):
    """(UTC, line, direction, track) of what the interval files have."""
    rows = [row for file in folder.glob("intervals/*/crossings.csv") for row in csv.DictReader(file.open())]
    return {(row["utc"].replace(" ", "T"), row["gate"], row["direction"], int(row["track_id"])) for row in rows}


@needs_mosquitto
@pytest.mark.skipif(find_spec("paho") is None, reason="needs the package paho-mqtt")
def test_every_crossing_and_zone_entry_is_told_once_to_both(camera, tmp_path):
    """While the broker is away for a time, and over the end of the run."""
    folder = tmp_path / "out"
    (tmp_path / "yard.toml").write_text(SITE)
    chosen = settings(
        NEVER_ROLLS,
        "events.pictures=true",
        ("output.lines", ["gate:160,0,160,240"]),
        ("output.site", tmp_path / "yard.toml"),
    )
    with HookServer() as server, Mosquitto(tmp_path) as broker, Listener(broker) as listener:

        def story(seen):
            yield lambda _: len(of_kind(server.taken(), "crossing")) >= 2
            yield lambda _: listener.texts("vidtrack/yard-1/entry")
            yield lambda _: run.board.now().reading["events"]["mqtt"]["sent"]

        receivers = Receivers(broker.url(), server.url("/geheim"), "sesame", "yard-1")
        with LiveRun(camera.url(), chosen, folder, LiveExtras(receivers=receivers)) as run:
            play(run, story)
            assert run.board.now().reading["events"]["mqtt"]["sent"]
        left = Outbox(folder / "outbox" / "webhook", 1e6).oldest(1000)
        posted = server.taken() + [json.loads(line) for line in left]
        heard = [(topic, text) for topic, text, _ in listener.messages]
        published = [json.loads(text) for topic, text in heard if topic.endswith(("/crossing", "/entry", "/conflict"))]
        kept = [topic for topic, _ in heard]
    assert not of_kind(posted, "problem")
    told = {(one["utc"], one["line"], one["direction"], one["track_id"]) for one in of_kind(posted, "crossing")}
    assert told == crossings(folder)
    assert len({one["id"] for one in posted}) == len(posted)
    assert {one["id"] for one in published} <= {one["id"] for one in posted}
    assert all(one["speed_kmh"] > 0 for one in of_kind(posted, "crossing"))
    entered = of_kind(posted, "entry")
    assert entered
    assert {one["zone"] for one in entered} == {"east"}
    for one in (*of_kind(posted, "crossing"), *entered):
        picture = cv2.imdecode(np.fromfile(folder / one["picture"], np.uint8), cv2.IMREAD_COLOR)
        assert picture.shape == (240, 320, 3)
        assert one["id"] in one["picture"]
    assert "homeassistant/device/vidtrack-yard-1/config" in kept
    texts = [path.read_text() for path in folder.rglob("*") if path.suffix in (".json", ".jsonl", ".csv", ".toml")]
    assert not any(secret in text for secret in SECRETS for text in texts)


def test_a_camera_that_fails_is_told_and_so_is_its_return(tmp_path):
    """From before its first picture on."""
    chosen = settings("live.timeout_s=0.2", "live.backoff_s=0.6", "live.retry_first=true")
    pictures = [act for _ in range(500) for act in (Picture(grey(100)), 0.02)]
    connect = script_of(Script(), Script(), Script(*pictures))
    with HookServer() as server:
        extras = LiveExtras(receivers=Receivers(webhook=server.url(), camera="north"))
        with LiveRun("http://u:geheim@camera/", chosen, tmp_path / "out", extras, connect=connect) as run:
            play(run, lambda seen: iter([lambda _: len(of_kind(server.taken(), "problem")) >= 2]))
        problems = of_kind(server.taken(), "problem")
    assert [one["on"] for one in problems[:2]] == [True, False]
    assert "nothing came" in problems[0]["why"]
    assert "geheim" not in json.dumps(problems)


def test_a_process_that_follows_one_that_crashed_says_so(tmp_path):
    connect = script_of(Script(*[act for _ in range(200) for act in (Picture(grey(100)), 0.02)]))
    with HookServer() as server:
        extras = LiveExtras(receivers=Receivers(webhook=server.url(), camera="north"))
        with LiveRun(
            "http://camera/", settings(), tmp_path / "out", extras, connect=connect, after="ended with code -9"
        ) as run:
            play(run, lambda seen: iter([lambda _: len(server.taken()) >= 2]))
    assert [(one["on"], one["why"]) for one in server.taken()[:2]] == [(True, "ended with code -9"), (False, None)]


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--mqtt", "mqtt://u:geheim@broker"], "need -o DIR"),
        (["-o", "out", "--mqtt", "u:geheim@broker"], "write it as mqtt://"),
        (["-o", "out", "--webhook", "https://"], "write it as https://"),
        (["-o", "out", "--webhook-token", "geheim"], "no effect without --webhook"),
        (["-o", "out", "--set", "events.queue_bytes=1e6"], "no effect without --mqtt or --webhook"),
        (["-o", "out", "--keep", "pictures:7d"], "it needs events.pictures=true"),
        (["-o", "out", "--mqtt", "mqtt://b", "--set", "events.ca_file=none.pem"], "none.pem cannot be used"),
    ],
)
def test_mistakes_are_told_before_the_camera_is_opened(tmp_path, monkeypatch, options, said):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ConfigError) as error:
        cli.main(["live", "http://127.0.0.1:9/", *options], standalone_mode=False)
    assert said in str(error.value)
    assert "geheim" not in str(error.value)
    assert not list(tmp_path.rglob("summary.json"))


def test_pictures_are_kept_within_their_own_limit(tmp_path, monkeypatch):
    monkeypatch.setattr("vidtrack.recording.event_pictures._PRUNE_S", 0.0)
    monkeypatch.setattr("vidtrack.recording.event_pictures.annotated_jpeg", lambda *_: b"x" * 1000)
    pictures = EventPictures(tmp_path, [], None, 75, Limits(None, 3500.0), Reserve(0.0))
    events = [Event(Kind.CROSSING, "north", time.time() + 90_000 * number, {}) for number in range(6)]
    assert pictures.write(events[0], 0.0) is None  # no frame came yet
    pictures._recent.append(type("Step", (), {"time_s": 0.0}))
    paths = [pictures.write(event, 0.0) for event in events]
    pictures.prune()
    assert [(tmp_path / path).exists() for path in paths] == [False] * 3 + [True] * 3
    assert len(list((tmp_path / "pictures").iterdir())) == 3  # empty days are gone


def test_settings_of_events_are_of_cameras_alone():
    with pytest.raises(ConfigError, match=r"events\.pictures has no effect on a video"):
        load(assignments=["events.pictures=true"], kind="a video")
