"""A picture without an end takes a bounded part of the memory, and is told."""

import resource
import socket
from contextlib import suppress
from threading import Thread

import cv2
import pytest
from cameras import HANG_S, grey, within

from vidtrack.errors import SourceError
from vidtrack.video.live.address import parse_address
from vidtrack.video.live.connection import Connection

HEAD = b"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace; boundary=part\r\n\r\n"
PART = b"--part\r\nContent-Type: image/jpeg\r\n\r\n"


@pytest.fixture
def endless():
    """The address of a camera whose last picture has no end."""
    jpeg = cv2.imencode(".jpg", grey(90))[1].tobytes()

    def serve():
        with suppress(OSError):
            client, _ = server.accept()
            client.recv(4096)
            client.sendall(HEAD + 60 * (PART + jpeg + b"\r\n") + PART)
            while True:
                client.sendall(bytes(1 << 20))

    with socket.create_server(("127.0.0.1", 0)) as server:
        Thread(target=serve, daemon=True).start()
        yield f"http://127.0.0.1:{server.getsockname()[1]}/"


def test_a_picture_without_an_end(endless):
    connection = Connection(parse_address(endless, HANG_S), HANG_S)
    before_kb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with within(), pytest.raises(SourceError, match="a picture larger than 128 MB came"):
        for _ in connection.packets():
            pass
    connection.close()
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before_kb < 400_000
