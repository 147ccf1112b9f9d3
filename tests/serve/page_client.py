"""A page over cameras that are made up, and ways to look at it."""

from __future__ import annotations

import base64
import json
import socket
import time
import urllib.error
import urllib.request
from contextlib import contextmanager
from threading import Lock

import cv2
import numpy as np

from vidtrack.serve.camera import Camera
from vidtrack.serve.page import Page

HANG_S = 180.0
"""What takes longer hangs. Nothing is measured by it."""

READING = {
    "fps": 25.0,
    "fps_in": 24.97,
    "width": 640,
    "height": 360,
    "began": "2026-11-21T12:00:00.000+00:00",
    "frames_received": 5120,
    "frames_read": 5000,
    "frames_dropped": 120,
    "decode_errors": 3,
    "reconnects": 2,
    "stalls": 1,
    "truncated": False,
    "latency_ms": {"p50": 41.2, "p95": 63.0, "p99": 88.5, "max": 140.0},
    "lost": {"results": 0, "rerun": 7},
}


class MadeUp:
    """A camera whose frame number grows with every look; it counts what is asked of it."""

    def __init__(self, source="rtsp://***@10.0.0.7:554/stream", encode_s=0.0, **changes):
        self.source = source
        self.encode_s = encode_s
        self.changes = changes
        self.looks = self.pictures = self.at_once = self.most_at_once = 0
        self.counts = None
        self._lock = Lock()

    def status(self):
        self.looks += 1
        now_s = time.time()
        where = {"x_px": 310.5, "y_px": 180.25, "vx_px_s": 60.0, "vy_px_s": -80.0, "box_px": [290.0, 165.0, 41.0, 30.5]}
        return {
            "state": "running",
            "restarts": 3,
            "reading": READING,
            "problems": [(now_s - 700, "no answer in 5 s"), (now_s - 60, 'the camera said "<b>stop</b>"')],
            "source": self.source,
            "started_unix_s": now_s - 3600,
            "now_unix_s": now_s,
            "frame": self.looks,
            "time_s": self.looks / 25,
            "frame_age_s": 0.04,
            "fps_out": 24.6,
            "tracks": [{"track_id": number, "status": "confirmed", **where} for number in (7, 12)],
            "counts": {"north": {"left": 12, "right": 9}, 'in "A"\\': {"up": 3, "down": 0}},
        } | self.changes

    def picture(self):
        with self._lock:
            self.pictures += 1
            self.at_once += 1
            self.most_at_once = max(self.at_once, self.most_at_once)
        time.sleep(self.encode_s)
        picture = np.full((360, 640, 3), 90, np.uint8)
        cv2.rectangle(picture, (290, 165), (331, 195), (0, 220, 255), 2)
        cv2.putText(picture, f"{self.pictures}", (10, 350), cv2.FONT_HERSHEY_SIMPLEX, 1, (255, 255, 255))
        with self._lock:
            self.at_once -= 1
        return cv2.imencode(".jpg", picture)[1].tobytes()

    def camera(self):
        return Camera(self.status, self.picture, lambda: self.counts)


@contextmanager
def page_over(cameras, token=None, place="0"):
    """The address of a page over made-up cameras by name."""
    with Page(place, token) as page:
        page.show({name: camera.camera() for name, camera in cameras.items()})
        yield page.url


def get(url, bearer=None, password=None, host=None):
    """Status code, headers and body of an answer."""
    headers = {} if host is None else {"Host": host}
    if bearer is not None:
        headers["Authorization"] = f"Bearer {bearer}"
    if password is not None:
        headers["Authorization"] = "Basic " + base64.b64encode(f"anyone:{password}".encode()).decode()
    try:
        with urllib.request.urlopen(urllib.request.Request(url, headers=headers), timeout=HANG_S) as answer:
            return answer.status, answer.headers, answer.read()
    except urllib.error.HTTPError as error:
        return error.code, error.headers, error.read()


def get_json(url):
    return json.loads(get(url)[2])


def connect(url, request=b""):
    """A raw connection with little room for what comes."""
    host, port = url.removeprefix("http://").rstrip("/").split(":")
    client = socket.socket()
    client.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    client.connect((host, int(port)))
    client.sendall(request)
    return client


def wait_for(condition):
    """Wait until the condition holds."""
    until = time.monotonic() + HANG_S
    while not condition():
        assert time.monotonic() < until, "waited in vain"
        time.sleep(0.01)
