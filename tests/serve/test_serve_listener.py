"""Where the page may be: on this machine by default, elsewhere with a token, and never where somebody else is."""

import socket

import pytest

from vidtrack.errors import ConfigError
from vidtrack.serve.listener import listen, url_of


@pytest.mark.parametrize("place", ["0", "127.0.0.1:0", "localhost:0"])
def test_this_machine_needs_no_token(place):
    with listen(place, token=None) as listener:
        assert listener.getsockname()[0] == "127.0.0.1"
        assert url_of(listener) == f"http://127.0.0.1:{listener.getsockname()[1]}/"


@pytest.mark.parametrize("token", [None, ""])
def test_other_machines_need_a_token(token):
    with pytest.raises(ConfigError, match=r"0\.0\.0\.0:0: .*--http-token or VIDTRACK_TOKEN"):
        listen("0.0.0.0:0", token)
    with listen("0.0.0.0:0", "secret") as listener:
        assert listener.getsockname()[0] == "0.0.0.0"
        assert (
            url_of(listener) == f"http://{socket.gethostname()}:{listener.getsockname()[1]}/"
        )  # one that can be typed


@pytest.mark.skipif(not socket.has_ipv6, reason="needs IPv6")
def test_ipv6_addresses_stand_in_brackets():
    try:
        listener = listen("[::1]:0", None)
    except ConfigError as error:
        pytest.skip(f"no IPv6 here: {error}")
    with listener:
        assert url_of(listener) == f"http://[::1]:{listener.getsockname()[1]}/"


def test_a_port_in_use_is_one_line():
    with listen("0", None) as listener:
        port = listener.getsockname()[1]
        with pytest.raises(ConfigError, match=f"--http {port}: address already in use; give another") as caught:
            listen(str(port), None)
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2
    listen(str(port), None).close()  # it is free again at once


@pytest.mark.parametrize("place", ["", "x", ":8080", "70000", "1:2:3", "::1:8080", "http://0.0.0.0:80", "8080/"])
def test_a_malformed_place(place):
    with pytest.raises(ConfigError, match="write it as PORT or HOST:PORT"):
        listen(place, "secret")


@pytest.mark.parametrize(
    ("place", "message"), [("no.such.host.invalid:0", "host name is unknown"), ("192.0.2.7:0", "cannot assign")]
)
def test_a_host_that_is_not_here(place, message):
    with pytest.raises(ConfigError, match=message):
        listen(place, "secret")
