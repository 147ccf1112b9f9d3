"""Where the page may be: on this machine by default, elsewhere with a token, and never where somebody else is."""

import socket

import pytest

from vidtrack.errors import ConfigError
from vidtrack.serve.door import open_door, url_of


@pytest.mark.parametrize("place", ["0", "127.0.0.1:0", "localhost:0"])
def test_this_machine_needs_no_token(place):
    with open_door(place, token=None) as door:
        assert door.getsockname()[0] == "127.0.0.1"
        assert url_of(door) == f"http://127.0.0.1:{door.getsockname()[1]}/"


@pytest.mark.parametrize("token", [None, ""])
def test_other_machines_need_a_token(token):
    with pytest.raises(ConfigError, match=r"0\.0\.0\.0:0: .*--http-token or VIDTRACK_TOKEN"):
        open_door("0.0.0.0:0", token)
    with open_door("0.0.0.0:0", "secret") as door:
        assert door.getsockname()[0] == "0.0.0.0"


@pytest.mark.skipif(not socket.has_ipv6, reason="needs IPv6")
def test_ipv6_addresses_stand_in_brackets():
    try:
        door = open_door("[::1]:0", None)
    except ConfigError as error:
        pytest.skip(f"no IPv6 here: {error}")
    with door:
        assert url_of(door) == f"http://[::1]:{door.getsockname()[1]}/"


def test_a_port_in_use_is_one_line():
    with open_door("0", None) as door:
        port = door.getsockname()[1]
        with pytest.raises(ConfigError, match=f"--http {port}: address already in use; give another") as caught:
            open_door(str(port), None)
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2
    open_door(str(port), None).close()  # it is free again at once


@pytest.mark.parametrize("place", ["", "x", ":8080", "70000", "1:2:3", "::1:8080", "http://0.0.0.0:80", "8080/"])
def test_a_malformed_place(place):
    with pytest.raises(ConfigError, match="write it as PORT or HOST:PORT"):
        open_door(place, "secret")


@pytest.mark.parametrize(
    ("place", "message"), [("no.such.host.invalid:0", "host name is unknown"), ("192.0.2.7:0", "cannot assign")]
)
def test_a_host_that_is_not_here(place, message):
    with pytest.raises(ConfigError, match=message):
        open_door(place, "secret")
