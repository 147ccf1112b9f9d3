"""MQTT against a real broker: at least once, whether the broker dies, freezes or comes late, and TLS is verified."""

import json
import signal
import subprocess
from importlib.util import find_spec

import pytest
from receivers import Listener, Mosquitto, finish, needs_mosquitto, wait_for

import vidtrack.output.events.sender as sender
from vidtrack.errors import ConfigError
from vidtrack.output.events.address import parse_broker
from vidtrack.output.events.event import Event, Kind
from vidtrack.output.events.mqtt import Mqtt, State, topic_level
from vidtrack.output.events.outbox import Outbox
from vidtrack.output.events.sender import Sender
from vidtrack.output.events.webhook import tls_context

pytestmark = [
    needs_mosquitto,
    pytest.mark.skipif(find_spec("paho") is None, reason="needs the package paho-mqtt"),
]
COUNTS = {"gate": {"left": 3, "right": 0}}


@pytest.fixture(autouse=True)
def hurried(monkeypatch):
    monkeypatch.setattr(sender, "_BACKOFF_S", 0.02)
    monkeypatch.setattr(sender, "_LOOK_S", 0.05)


@pytest.fixture(scope="module")
def broker(tmp_path_factory):
    with Mosquitto(tmp_path_factory.mktemp("broker")) as broker:
        yield broker


def receiver(broker, state=lambda: State(None, COUNTS), url=None, context=None, timeout_s=10.0):
    return Mqtt(parse_broker(url or broker.url()), "north", state, "homeassistant", timeout_s, context)


def events(*numbers):
    return [Event(Kind.CROSSING, "north", 1.8e9 + number, {"track_id": number}).as_line() for number in numbers]


def numbers(listener):
    return [json.loads(text)["track_id"] for text in listener.texts("vidtrack/north/crossing")]


def test_events_state_and_end_are_published(broker, tmp_path):
    box, state = Outbox(tmp_path, 1e6), [State(None, COUNTS)]
    with Listener(broker) as listener:
        sending = Sender(receiver(broker, lambda: state[0]), box)
        box.add(events(1, 2))
        wait_for(lambda: len(numbers(listener)) == 2)
        state[0] = State("waiting: no answer", COUNTS)
        wait_for(lambda: len(listener.texts("vidtrack/north/status")) == 2)
        finish(sending)
        wait_for(lambda: listener.texts("vidtrack/north/available")[-1] == "offline")
    assert listener.texts("vidtrack/north/available") == ["online", "offline"]
    assert [json.loads(text) for text in listener.texts("vidtrack/north/status")] == [
        {"problem": "OFF", "why": None},
        {"problem": "ON", "why": "waiting: no answer"},
    ]
    assert [json.loads(text) for text in listener.texts("vidtrack/north/counts")] == [COUNTS]
    with Listener(broker) as late:  # who comes later learns the state, and is told of no old event
        wait_for(lambda: len(late.messages) >= 4)
    assert {topic for topic, _, _ in late.messages} == {
        *(f"vidtrack/north/{name}" for name in ("status", "counts", "available")),
        "homeassistant/device/vidtrack-north/config",
    }


def test_no_event_is_lost_when_the_broker_is_killed(tmp_path):
    """Nor while it is away; one whose confirmation was lost comes twice, with the same id."""
    box, told = Outbox(tmp_path / "box", 1e6), []
    with Mosquitto(tmp_path) as broker:
        sending = Sender(receiver(broker), box, told.append)
        with Listener(broker) as listener:
            box.add(events(*range(20)))
            wait_for(lambda: len(numbers(listener)) == 20)
            first = numbers(listener)
        broker.kill()
        box.add(events(*range(20, 40)))
        wait_for(lambda: told)
        assert "events wait on the disk" in told[0]
        assert "ss/word" not in told[0]
        broker.start()
        with Listener(broker) as listener:
            box.add(events(*range(40, 45)))
            wait_for(lambda: box.waiting == 0)
            finish(sending)
            second = numbers(listener)
    # Who subscribes late misses what came before; the broker has confirmed all of it.
    assert set(first) == set(range(20))
    assert sending.sent >= 45
    assert second == sorted(second)


def test_the_broker_says_that_a_camera_is_offline_whose_process_is_gone(broker, tmp_path):
    code = (
        "import sys, time\n"
        "from vidtrack.output.events.address import parse_broker\n"
        "from vidtrack.output.events.mqtt import Mqtt, State\n"
        "one = Mqtt(parse_broker(sys.argv[1]), 'south', lambda: State(None, None), None, 10.0, None)\n"
        "one.open()\n"
        "time.sleep(60)\n"
    )
    from command_line import start

    with Listener(broker) as listener:
        process = start(broker.url(), cwd=tmp_path, program=("-c", code))
        wait_for(lambda: listener.texts("vidtrack/south/available") == ["online"])
        process.kill()
        process.communicate()
        wait_for(lambda: listener.texts("vidtrack/south/available") == ["online", "offline"])


def test_a_frozen_broker_delays_events_and_is_told(tmp_path):
    box, told = Outbox(tmp_path / "box", 1e6), []
    with Mosquitto(tmp_path) as broker:
        sending = Sender(receiver(broker, timeout_s=0.3), box, told.append)
        box.add(events(1))
        wait_for(lambda: box.waiting == 0)
        broker.process.send_signal(signal.SIGSTOP)
        box.add(events(2))
        wait_for(lambda: told)
        assert "0.3 s" in told[0]
        broker.process.send_signal(signal.SIGCONT)
        wait_for(lambda: box.waiting == 0)
        finish(sending)


def test_a_wrong_password_is_told_without_it(broker, tmp_path):
    box, told = Outbox(tmp_path, 1e6), []
    sending = Sender(receiver(broker, url=broker.url(password="geheim")), box, told.append)
    wait_for(lambda: told)
    sending.end()
    assert told[0].startswith(f"mqtt://***@localhost:{broker.port} refuses the connection: not authorized")


def test_tls_is_used_and_verified(tmp_path):
    """A certificate for localhost is trusted if it is the one in the file, and no other is."""
    made = tmp_path / "cert.pem", tmp_path / "key.pem"
    subject = ["-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"]
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", *subject]
    subprocess.run([*command, "-out", made[0], "-keyout", made[1]], check=True, capture_output=True)
    told = []
    with Mosquitto(tmp_path, made) as broker:
        box = Outbox(tmp_path / "trusted", 1e6)
        sending = Sender(receiver(broker, context=tls_context(made[0])), box, told.append)
        box.add(events(1))
        wait_for(lambda: box.waiting == 0)
        finish(sending)
        assert told == []
        stranger = Sender(receiver(broker, context=tls_context(None)), Outbox(tmp_path / "b", 1e6), told.append)
        wait_for(lambda: told)
        stranger.end()
    assert "its certificate is not trusted" in told[0]


def test_topics_have_plain_names():
    assert topic_level("192.168.1.20:554") == "192_168_1_20_554"
    assert topic_level("north-2") == "north-2"
    assert topic_level("+/#") == "camera"


def test_without_the_package_it_says_how_to_get_it(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "paho.mqtt.client", None)
    with pytest.raises(ConfigError, match=r"pip install \"vidtrack\[mqtt\]\""):
        Mqtt(parse_broker("mqtt://host"), "north", lambda: State(None, None), None, 1.0, None)
