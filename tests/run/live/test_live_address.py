"""What an address means, and that its password is never shown."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from vidtrack.errors import SourceError
from vidtrack.video.live.address import parse_address, redact, secrets


@pytest.mark.parametrize(
    ("address", "shown"),
    [
        ("rtsp://admin:secret@10.0.0.5:554/stream", "rtsp://***@10.0.0.5:554/stream"),
        ("rtsp://admin@10.0.0.5/stream", "rtsp://***@10.0.0.5/stream"),
        ("rtsp://10.0.0.5:554/stream", "rtsp://10.0.0.5:554/stream"),
        ("rtsp://admin:p@ss@w0rd@cam/stream", "rtsp://***@cam/stream"),
        ("rtsp://admin:a/b@cam/stream", "rtsp://***@cam/stream"),
        ("rtsp://admin:a?b#c@cam/stream", "rtsp://***@cam/stream"),
        ("http://cam/video?user=admin&password=secret&size=3", "http://cam/video?user=***&password=***&size=3"),
        ("http://cam/video?token=abc", "http://cam/video?token=***"),
        ("http://cam:80/at/a@b.mjpg", "http://cam:80/at/a@b.mjpg"),
        ("http://[fe80::1]:80/video", "http://[fe80::1]:80/video"),
        ("/dev/video0", "/dev/video0"),
        ("0", "0"),
    ],
)
def test_credentials_are_hidden(address, shown):
    assert redact(address) == shown


words = st.text("abcXYZ019!$%&()*+,;=:@/?#-_.~", min_size=4, max_size=12)


@given(user=st.text("abcde", min_size=1), password=words, path=st.sampled_from(["", "/", "/stream1", "/a/b?channel=1"]))
def test_no_password_is_ever_shown(user, password, path):
    shown = redact(f"rtsp://{user}:Q{password}Q@camera.example:554{path}")
    assert f"Q{password}Q" not in shown
    assert "camera.example" in shown or "@" in password or "/" in password


def test_the_address_object_does_not_show_them_either():
    address = parse_address("rtsp://admin:secret@cam:554/stream", 5.0)
    assert "secret" not in repr(address)
    assert address.url == "rtsp://admin:secret@cam:554/stream"
    assert address.name == "cam:554"


def test_the_hidden_parts_are_known():
    assert secrets("rtsp://admin:secret@cam/x?token=abc") == ["admin:secret", "abc"]
    assert secrets("rtsp://cam/x") == []


@pytest.mark.parametrize(
    ("source", "message"),
    [
        ("77", "no such device /dev/video77"),
        ("/dev/nothing", "no such device /dev/nothing"),
        ("ftp://admin:secret@cam/x", "ftp:// is not supported"),
        (__file__, "read it with vidtrack track"),
    ],
)
def test_what_is_no_live_source_is_refused(source, message):
    with pytest.raises(SourceError, match=message) as caught:
        parse_address(source, 5.0)
    assert "secret" not in str(caught.value)
