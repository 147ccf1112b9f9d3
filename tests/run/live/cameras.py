"""Cameras for the tests: GStreamer's RTSP server, a small HTTP server, and one made of pictures."""

from __future__ import annotations

import socket
import subprocess
import time
from collections import deque
from contextlib import contextmanager
from fractions import Fraction
from functools import cache
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Event, Thread

import av
import cv2
import numpy as np
import pytest
from command_line import SAMPLES

from vidtrack.errors import SourceError
from vidtrack.video.live.connection import Stalled

SYSTEM_PYTHON = "/usr/bin/python3"
SERVER = Path(__file__).with_name("rtsp_server.py")
HANG_S = 180.0
"""What takes longer hangs. Nothing is measured by it: a slow machine may take almost as long."""


def gstreamer_is_installed():
    code = (
        "import gi; gi.require_version('GstRtspServer', '1.0'); from gi.repository import Gst, GstRtspServer;"
        "Gst.init(None); parts = 'videotestsrc', 'x264enc', 'rtph264pay', 'valve';"
        "assert all(map(Gst.ElementFactory.find, parts))"
    )
    try:
        return subprocess.run([SYSTEM_PYTHON, "-c", code], capture_output=True, check=False).returncode == 0
    except FileNotFoundError:
        return False


needs_rtsp = pytest.mark.skipif(
    not gstreamer_is_installed(),
    reason="needs gir1.2-gst-rtsp-server-1.0, python3-gi and GStreamer's base, good and ugly plugins",
)


class RtspCamera:
    """A server process on loopback; use it with `with`. Its port stays its own while it is down."""

    def __init__(self, *options):
        self._place = socket.socket()  # bound and not listening: nobody else gets the port, and the server may
        self._place.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        self._place.bind(("127.0.0.1", 0))
        self.port = self._place.getsockname()[1]
        self.start(*options)

    def start(self, *options):
        command = [SYSTEM_PYTHON, str(SERVER), "--port", str(self.port), *options]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=subprocess.DEVNULL, text=True)
        assert int(self._process.stdout.readline()) == self.port

    def url(self, login="", path="cam"):
        return f"rtsp://{login}127.0.0.1:{self.port}/{path}"

    def tell(self, order):
        self._process.stdin.write(f"{order}\n")
        self._process.stdin.flush()

    def kill(self):
        self._process.kill()
        self._process.communicate()

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.kill()
        self._place.close()


class _Site(BaseHTTPRequestHandler):
    """/video.mjpg, /video.ts, /film.avi, /page, /silent, /closed, /private, and 404 for the rest."""

    def do_GET(self):
        server = self.server
        server.visits += 1
        if self.path == "/private" and "Authorization" not in self.headers:
            self.send_response(401)
            self.send_header("WWW-Authenticate", 'Basic realm="camera"')
            self.end_headers()
        elif self.path in ("/video.mjpg", "/video.ts"):
            kind = {"/video.mjpg": "multipart/x-mixed-replace; boundary=part", "/video.ts": "video/mp2t"}[self.path]
            self._start(kind)
            blocks = server.parts() if self.path == "/video.mjpg" else server.transport()
            connection = server.connection
            for block in blocks:
                if server.closing.is_set() or server.connection != connection:
                    return
                self.wfile.write(block)
        elif self.path == "/page":
            self._start("text/html")
            self.wfile.write(b"<html><body>no camera</body></html>" * 200)
        elif self.path == "/film.avi":
            self._start("video/x-msvideo")
            self.wfile.write((SAMPLES / "crossing.avi").read_bytes())
        elif self.path == "/silent":
            self._start("multipart/x-mixed-replace; boundary=part")
            server.closing.wait(2 * HANG_S)
        elif self.path != "/closed":
            self.send_error(404)

    def _start(self, kind):
        self.send_response(200)
        self.send_header("Content-Type", kind)
        self.end_headers()

    def log_message(self, *_):
        pass


class HttpCamera(ThreadingHTTPServer):
    """Serves `pictures` (H, W, 3) round and round at `fps`, as MJPEG and as MPEG-TS; use it with `with`.

    Counting `connection` up hangs up.
    """

    daemon_threads = True

    def __init__(self, pictures, fps=25.0):
        super().__init__(("127.0.0.1", 0), _Site)
        self.pictures = pictures
        self.fps = fps
        self.connection = self.visits = 0
        self.closing = Event()
        Thread(target=self.serve_forever, kwargs={"poll_interval": 0.05}, daemon=True).start()

    def handle_error(self, *_):
        """A client that hangs up is none of the tests' business."""

    def url(self, path="video.mjpg", login=""):
        return f"http://{login}127.0.0.1:{self.server_port}/{path}"

    def parts(self):
        for picture in self._paced(self.pictures):
            jpeg = cv2.imencode(".jpg", picture)[1].tobytes()
            yield b"--part\r\nContent-Type: image/jpeg\r\nContent-Length: %d\r\n\r\n" % len(jpeg) + jpeg + b"\r\n"

    def transport(self):
        class Blocks:
            waiting = b""

            def write(self, block):
                self.waiting += bytes(block)
                return len(block)

        out = Blocks()
        height, width = self.pictures[0].shape[:2]
        with av.open(out, "w", format="mpegts", options={"flush_packets": "1"}) as container:
            stream = container.add_stream("libx264", rate=Fraction(self.fps).limit_denominator(1001))
            stream.width, stream.height, stream.pix_fmt = width, height, "yuv420p"
            stream.options = {"preset": "ultrafast", "tune": "zerolatency", "g": "10"}
            for number, picture in enumerate(self._paced(self.pictures)):
                frame = av.VideoFrame.from_ndarray(picture, format="bgr24")
                frame.pts, frame.time_base = number, Fraction(1, round(self.fps))
                container.mux(stream.encode(frame))
                yield out.waiting
                out.waiting = b""

    def _paced(self, items):
        start = time.monotonic()
        number = 0
        while not self.closing.is_set():
            yield items[number % len(items)]
            number += 1
            time.sleep(max(0.0, start + number / self.fps - time.monotonic()))

    def __exit__(self, *_):
        self.closing.set()
        self.shutdown()
        self.server_close()


class Picture:
    """Stands for a packet whose only picture is `image` (H, W) grey, stamped `stamp_s`."""

    size = 1

    def __init__(self, image, stamp_s=None, is_keyframe=True):
        self.image, self.stamp_s, self.is_keyframe = image, stamp_s, is_keyframe
        self.opaque = None


class Script:
    """A connection that plays a list: pictures, seconds to wait, or an error to raise; after its end it stalls."""

    fps, codec, is_raw, is_intra = 25.0, "script", False, False
    wait = staticmethod(time.sleep)

    def __init__(self, *acts):
        self._acts = acts
        self.closed = False

    def packets(self):
        for act in self._acts:
            if isinstance(act, Exception):
                raise act
            if isinstance(act, Picture):
                yield act
            else:
                self.wait(act)
        raise Stalled("nothing came")

    def decode(self, packet):
        picture = av.VideoFrame.from_ndarray(packet.image, format="gray")
        picture.opaque = packet.opaque
        self._stamp_s = packet.stamp_s
        return [picture]

    def stamp_s(self, picture):
        return self._stamp_s

    def start_decoder_anew(self):
        return []

    def close(self):
        self.closed = True


def script_of(*connections):
    """`connect` for LiveSource: each call gives the next connection, or raises it; then nobody answers."""
    left = deque(connections)

    def connect():
        if not left:
            raise SourceError("nobody answers")
        following = left.popleft()
        if isinstance(following, Exception):
            raise following
        return following

    return connect


@cache
def crossing():
    """(K, 240, 320, 3) the sample's pictures."""
    with av.open(str(SAMPLES / "crossing.avi")) as film:
        return [frame.to_ndarray(format="bgr24") for frame in film.decode(video=0)]


def grey(level, size=(48, 64)):
    return np.full(size, level, np.uint8)


@contextmanager
def within(seconds=HANG_S):
    """What happens inside does not hang."""
    began = time.monotonic()
    yield
    assert time.monotonic() - began < seconds


def coming(source):
    """The frames of a live source, without the pauses between them."""
    until = time.monotonic() + HANG_S
    for frame in source:
        assert time.monotonic() < until, "waited in vain"
        if frame is not None:
            yield frame


def wait_for(condition):
    """Wait until the condition holds."""
    until = time.monotonic() + HANG_S
    while not condition():
        assert time.monotonic() < until, "waited in vain"
        time.sleep(0.01)
