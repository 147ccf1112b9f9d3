"""What systemd is told, with a socket in its place."""

import socket
from threading import Event

import pytest

from vidtrack.service.notify import Reports, notify


@pytest.fixture
def systemd(tmp_path, monkeypatch):
    """The socket of systemd, for a watchdog of 0.15 s."""
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as place:
        place.bind(str(tmp_path / "notify"))
        place.settimeout(60)
        monkeypatch.setenv("NOTIFY_SOCKET", str(tmp_path / "notify"))
        monkeypatch.setenv("WATCHDOG_USEC", "150000")
        yield place


def test_it_is_ready_works_and_ends(systemd):
    with Reports(lambda: (True, "north: delivers")):
        assert systemd.recv(500) == b"READY=1"
        assert {systemd.recv(500) for _ in range(3)} == {b"STATUS=north: delivers\nWATCHDOG=1"}
    told = b""
    while told != b"STOPPING=1":
        told = systemd.recv(500)


def test_the_watchdog_is_not_fed_while_something_hangs(systemd):
    hangs = Event()
    with Reports(lambda: (not hangs.is_set(), "north: no frames")):
        systemd.recv(500)
        assert b"WATCHDOG=1" in systemd.recv(500)
        hangs.set()
        told = [systemd.recv(500) for _ in range(4)]
    assert told[-1] == b"STATUS=north: no frames"


def test_the_socket_may_be_abstract(monkeypatch):
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as place:
        place.bind("\0vidtrack-test")
        place.settimeout(60)
        monkeypatch.setenv("NOTIFY_SOCKET", "@vidtrack-test")
        notify("STATUS=x")
        assert place.recv(500) == b"STATUS=x"


def test_without_systemd_nothing_is_told_and_nothing_fails(monkeypatch):
    monkeypatch.delenv("NOTIFY_SOCKET", raising=False)
    with Reports(lambda: pytest.fail("nobody asked")):
        pass
    monkeypatch.setenv("NOTIFY_SOCKET", "/nowhere/at/all")
    notify("READY=1")
