"""Many, slow and dead clients cost little, and the tracker nothing."""

import contextlib
import socket
import time
from concurrent.futures import ThreadPoolExecutor
from threading import Event

import pytest
from page_client import HANG_S, MadeUp, connect, get, page_over, wait_for

from vidtrack.serve import connection
from vidtrack.serve.page import Page

ASK = b"GET /%s HTTP/1.1\r\nHost: localhost\r\n\r\n"


def answers(url):
    return get(url + "healthz")[0] == 200


def test_pictures_are_made_once_for_all_and_not_too_often():
    camera = MadeUp(encode_s=0.05)
    with page_over({"gate": camera}) as url, ThreadPoolExecutor(12) as viewers:
        began = time.monotonic()
        pictures = list(viewers.map(lambda _: get(url + "picture/0.jpg")[2], range(60)))
        took_s = time.monotonic() - began
    assert len(pictures) == 60
    assert camera.most_at_once == 1
    assert camera.pictures <= 1 + took_s / 0.2


def test_nothing_is_made_while_nobody_looks():
    camera = MadeUp()
    with page_over({"gate": camera}) as url:
        get(url + "healthz")
        assert camera.pictures == 0
        looks = camera.looks
        time.sleep(0.2)
        assert camera.looks == looks


def test_a_client_that_never_reads_delays_nobody():
    camera = MadeUp(tracks=[{"track_id": number} for number in range(5000)])
    with page_over({"gate": camera}) as url:
        deaf = [connect(url, ASK % path) for path in (b"tracks", b"tracks", b"picture/0.jpg", b"status")]
        assert answers(url)
        looks = -1
        until_s = time.monotonic() + HANG_S
        while looks != camera.looks:  # its streams stand still: they wait for the client, and keep nothing for it
            assert time.monotonic() < until_s
            looks = camera.looks
            time.sleep(0.3)
        assert answers(url)
        for client in deaf:
            client.close()
        assert answers(url)


def test_a_client_that_takes_nothing_is_cut_off(monkeypatch):
    monkeypatch.setattr("vidtrack.serve.listener._GONE_S", 0.5)
    camera = MadeUp(tracks=[{"track_id": number} for number in range(20000)])
    with Page("0") as page:
        page.show({"gate": camera.camera()})
        client = connect(page.url, ASK % b"tracks")
        wait_for(lambda: camera.looks and connections_of(page) == 0)
        with pytest.raises(ConnectionResetError):
            client.makefile("rb").read()


def test_who_connects_has_to_ask_soon(monkeypatch):
    monkeypatch.setattr("vidtrack.serve.connection.ASK_S", 0.2)
    with page_over({"gate": MadeUp()}) as url:
        client = connect(url)
        client.settimeout(HANG_S)
        assert client.recv(10) == b""


def test_the_number_of_connections_is_bounded(monkeypatch):
    monkeypatch.setattr("vidtrack.serve.connection.MOST", 5)
    monkeypatch.setattr("vidtrack.serve.connection.ASK_S", 2 * HANG_S)
    with Page("0") as page:
        page.show({"gate": MadeUp().camera()})
        silent = [connect(page.url, b"GET /") for _ in range(20)]
        wait_for(lambda: sum(map(is_open, silent)) == 5)
        assert connections_of(page) == 5
        for client in silent:
            client.close()
        wait_for(lambda: connections_of(page) == 0)
        assert answers(page.url)


def connections_of(page):
    return len(page._server._server.server_state.connections)


def is_open(client):
    try:
        return client.recv(1, socket.MSG_DONTWAIT) != b""
    except BlockingIOError:
        return True
    except ConnectionError:
        return False


def test_the_page_ends_at_once_whoever_is_looking():
    camera = MadeUp()
    with page_over({"gate": camera}) as url:
        clients = [connect(url, ASK % b"tracks") for _ in range(3)]
        wait_for(lambda: camera.looks > 3)
        began = time.monotonic()
    assert time.monotonic() - began < HANG_S
    for client in clients:
        client.close()


def test_nonsense_is_refused_in_silence(capfd):
    with page_over({"gate": MadeUp()}) as url:
        client = connect(url, b"\x16\x03\x01\x02\x00 no http\r\n\r\n")
        assert b" 400 " in client.recv(1000)
        assert answers(url)
    assert capfd.readouterr() == ("", "")


def test_a_request_that_drips_is_not_waited_for(monkeypatch):
    """Each byte comes in time, and the whole does not."""
    monkeypatch.setattr("vidtrack.serve.connection.ASK_S", 0.3)
    with Page("0") as page:
        page.show({"gate": MadeUp().camera()})
        client = connect(page.url, b"GET / HTTP/1.1\r\n")
        until_s = time.monotonic() + HANG_S
        with contextlib.suppress(ConnectionError):
            while is_open(client):
                assert time.monotonic() < until_s
                client.sendall(b"X-a: b\r\n")
                time.sleep(0.02)
        wait_for(lambda: connections_of(page) == 0)


def test_health_is_answered_whoever_holds_connections_open(monkeypatch):
    monkeypatch.setattr("vidtrack.serve.connection.ASK_S", 2 * HANG_S)
    with Page("0") as page:
        page.show({"gate": MadeUp().camera()})
        held = [connect(page.url, b"GET / HTTP/1.1\r\n") for _ in range(120)]
        wait_for(lambda: connections_of(page) == sum(map(is_open, held)) == connection.MOST_EACH)
        for _ in range(15):
            held.append(connect(page.url, b"GET / HTTP/1.1\r\n"))
            assert get(page.url + "healthz")[0] == 200
        assert connections_of(page) <= connection.MOST_EACH
        for client in held:
            client.close()


def test_health_is_answered_whoever_streams(monkeypatch):
    """All connections of an address are being answered: the oldest one gives way, not the one that asks."""
    monkeypatch.setattr("vidtrack.serve.connection.MOST_EACH", 8)
    with page_over({"gate": MadeUp()}) as url:
        streams = [connect(url, ASK % b"tracks") for _ in range(8)]
        for client in streams:
            assert client.recv(5) == b"HTTP/"
        for _ in range(3):
            assert answers(url)
        wait_for(lambda: sum(map(is_open_stream, streams)) == 7)  # an answered request has left its place to the next
        assert is_open_stream(streams[-1])
        for client in streams:
            client.close()


def is_open_stream(client):
    """Whether the server has not closed it; what has come is read."""
    with contextlib.suppress(BlockingIOError, ConnectionError):
        while client.recv(65536, socket.MSG_DONTWAIT):
            pass
    return is_open(client)


def test_a_request_is_read_before_its_connection_may_give_way(monkeypatch):
    """While the page is busy, a request comes, and then as many connections as there may be."""
    monkeypatch.setattr("vidtrack.serve.connection.MOST_EACH", 8)
    with Page("0") as page:
        page.show({"gate": MadeUp().camera()})
        assert answers(page.url)
        busy, free = Event(), Event()
        loop = page._server._server.servers[0].get_loop()
        loop.call_soon_threadsafe(lambda: (busy.set(), free.wait(HANG_S)))
        assert busy.wait(HANG_S)
        asks = connect(page.url, ASK % b"healthz")
        held = [connect(page.url) for _ in range(12)]
        free.set()
        asks.settimeout(HANG_S)
        assert asks.recv(15) == b"HTTP/1.1 200 OK"
        for client in [asks, *held]:
            client.close()
