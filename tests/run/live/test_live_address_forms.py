"""Addresses as people write them: special characters in a password, no host, no such port."""

import pytest
from cameras import RtspCamera, needs_rtsp

from vidtrack.config.live import LiveSettings
from vidtrack.errors import SourceError
from vidtrack.video.live.address import parse_address
from vidtrack.video.live.connection import Connection


@pytest.mark.parametrize(
    ("source", "url"),
    [
        ("rtsp://u:a/b?c#d@cam/x?y#z", "rtsp://u:a%2Fb%3Fc%23d@cam/x?y#z"),
        ("rtsp://u:a@b:c@cam/x", "rtsp://u:a@b:c@cam/x"),
        ("rtsp://u:a%2Fb@cam/x", "rtsp://u:a%2Fb@cam/x"),
        ("http://u:a@cam/at/a@b.mjpg?to=http://c:d/@", "http://u:a@cam/at/a@b.mjpg?to=http://c:d/@"),
        ("rtsp://u:p w\u00e4@[::1]:554/x", "rtsp://u:p%20w%C3%A4@[::1]:554/x"),
        ("http://cam:80/at/a@b.mjpg?x=y/z#@", "http://cam:80/at/a@b.mjpg?x=y/z#@"),
    ],
)
def test_a_password_need_not_be_escaped(source, url):
    assert parse_address(source, 5.0).url == url


@needs_rtsp
def test_a_password_of_special_characters_opens_the_camera():
    password = "ge/h?e#i@m w%C3"
    with RtspCamera("--login", f"u:{password}") as camera:
        address = parse_address(camera.url(f"u:{password.replace('%', '%25')}@"), 60.0)
        connection = Connection(address, 60.0, LiveSettings().ffmpeg)
        assert next(connection.packets()).size
        connection.close()


@pytest.mark.parametrize(
    "source",
    ["rtsp://", "rtsp:///cam", "rtsp://u:geheim@", "http://u:geheim@cam:99999/x", "http://cam:0/x", "http://[::1/x"],
)
def test_an_address_without_a_host_or_port_is_refused_at_once(source):
    with pytest.raises(SourceError, match="names no host, or no such port") as caught:
        parse_address(source, 5.0)
    assert "geheim" not in str(caught.value)


def test_a_folder_is_no_camera(tmp_path):
    with pytest.raises(SourceError, match="read it with vidtrack track"):
        parse_address(str(tmp_path), 5.0)
