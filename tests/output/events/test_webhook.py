"""Webhooks: each event once if all is well, again until the server takes it, and secrets stay where they are."""

import json
import socket

import pytest
from receivers import HookServer, finish, wait_for

import vidtrack.output.events.sender as sender
from vidtrack.errors import ConfigError
from vidtrack.output.events.address import parse_broker, parse_hook, secret_parts
from vidtrack.output.events.event import Event, Kind
from vidtrack.output.events.outbox import Outbox
from vidtrack.output.events.sender import Sender
from vidtrack.output.events.webhook import Webhook


@pytest.fixture(autouse=True)
def hurried(monkeypatch):
    monkeypatch.setattr(sender, "_BACKOFF_S", 0.02)


def events(count):
    return [Event(Kind.CROSSING, "north", 1.8e9 + number, {"track_id": number}).as_line() for number in range(count)]


def numbers(found):
    return [event["track_id"] for event in found]


def test_each_event_is_posted_as_json_with_its_id(tmp_path):
    box, told = Outbox(tmp_path, 1e6), []
    with HookServer() as server:
        sending = Sender(Webhook(parse_hook(server.url("/a?key=geheim")), "sesame", 5.0, None), box, told.append)
        box.add(events(3))
        wait_for(lambda: box.waiting == 0)
        finish(sending)
    assert numbers(server.taken()) == [0, 1, 2]
    for path, headers, event, _ in server.posts:
        assert path == "/a?key=geheim"
        assert headers["Content-Type"] == "application/json"
        assert headers["Authorization"] == "Bearer sesame"
        assert headers["Idempotency-Key"] == event["id"]
    assert told == []
    assert (sending.sent, sending.failing) == (3, None)


def test_what_a_server_does_not_take_now_is_posted_again_and_what_it_never_will_is_left_out(tmp_path):
    box, told = Outbox(tmp_path, 1e6), []
    with HookServer() as server:
        server.answers = [500, 302, 401, 204, 422]  # three times the first one, which is then taken; the second is bad
        hook = Webhook(parse_hook(server.url()), None, 5.0, None)
        box.add(events(3))
        Sender(hook, box, told.append)
        wait_for(lambda: box.waiting == 0)
    assert numbers(server.taken()) == [0, 2]
    assert hook.refused == 1
    assert len(told) == 1  # not once for each attempt
    assert "it answers 500; events wait on the disk" in told[0]


def test_while_nobody_answers_events_wait_and_the_next_run_posts_them(tmp_path):
    with socket.create_server(("127.0.0.1", 0)) as place:
        port = place.getsockname()[1]
    box, told = Outbox(tmp_path, 1e5), []
    dead = Sender(Webhook(parse_hook(f"http://u:geheim@127.0.0.1:{port}/geheim"), None, 5.0, None), box, told.append)
    box.add(events(5))
    wait_for(lambda: told)
    assert dead.failing is None  # there is room
    assert dead.waiting == 5
    box.add(line for number in range(40) for line in events(50))
    wait_for(lambda: dead.failing is not None)
    assert "were dropped" in dead.failing
    assert not any("geheim" in text for text in (*told, dead.failing))
    finish(dead)
    with HookServer() as server:
        box = Outbox(tmp_path, 1e5)
        waiting = box.waiting
        alive = Sender(Webhook(parse_hook(server.url()), None, 5.0, None), box, told.append)
        wait_for(lambda: box.waiting == 0)
        assert len(server.taken()) == waiting
        assert alive.failing is None
        assert alive.dropped == 2005 - waiting


def test_the_user_of_an_address_is_sent_as_basic_authorization(tmp_path):
    box = Outbox(tmp_path, 1e6)
    with HookServer() as server:
        Sender(Webhook(parse_hook(server.url(login="u:a%40b@")), None, 5.0, None), box)
        box.add(events(1))
        wait_for(lambda: server.posts)
    assert server.posts[0][1]["Authorization"] == "Basic dTphQGI="


@pytest.mark.parametrize(
    ("parse", "address", "said"),
    [
        (parse_hook, "ftp://u:geheim@host/geheim", "--webhook ftp://***: write it as"),
        (parse_hook, "https://host:x/geheim", "--webhook https://***"),
        (parse_broker, "host", "--mqtt ***: write it as mqtt://"),
        (parse_broker, "mqtt://u:geheim@", "--mqtt mqtt://***@: write it as"),
        (parse_broker, "mqtt://u:geheim@host/a/+", "may not contain"),
    ],
)
def test_addresses_that_are_none_are_refused_without_their_secrets(parse, address, said):
    with pytest.raises(ConfigError) as error:
        parse(address)
    assert said in str(error.value)
    assert "geheim" not in str(error.value)


def test_addresses_are_shown_without_secrets():
    broker = parse_broker("mqtts://cam:p@ss/w:ord%25@broker.local/site/a")
    assert (broker.host, broker.port, broker.tls, broker.prefix) == ("broker.local", 8883, True, "site/a")
    assert (broker.user, broker.password) == ("cam", "p@ss/w:ord%")
    hook = parse_hook("https://u:pw@host:8443/api/webhook/geheim?t=1")
    assert hook.shown == "https://host:8443/***"
    for one in (broker, hook):
        assert not any(secret in repr(one) for secret in ("p@ss", "pw", "geheim"))
    assert secret_parts("mqtt://cam:pw@h", "https://u:pw@host/geheim?t=1") == ["cam:pw", "u:pw", "geheim?t=1"]
    assert json.dumps(secret_parts(None, None)) == "[]"
