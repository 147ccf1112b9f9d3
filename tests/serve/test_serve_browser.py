"""The page in a real browser, at the sizes of a phone and of a desk."""

import re
import shutil
import subprocess

import cv2
import numpy as np
import pytest
from page_client import MadeUp, page_over

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")
SIZES = {"phone": (390, 1600), "desk": (1400, 1000)}

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium (Debian's package chromium)")


class NoPicture(MadeUp):
    def picture(self):
        return None


class FailsSoon(MadeUp):
    def status(self):
        if self.looks > 1:
            raise ValueError("made up")
        return super().status()


def browse(url, size, folder, *options):
    """What Chromium says after the page has lived for some seconds."""
    command = [
        CHROMIUM,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--hide-scrollbars",
        "--disable-dev-shm-usage",
        f"--user-data-dir={folder / 'profile'}",
        f"--window-size={size[0]},{size[1]}",
        "--virtual-time-budget=3000",
        *options,
        url,
    ]
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout


@pytest.fixture(scope="module")
def url():
    with page_over({"gate": MadeUp(), "yard": NoPicture(state="waiting", frame_age_s=73.0)}) as url:
        yield url


def text_of(html):
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", html.partition("<template")[0]))


def test_the_page_says_everything(url, tmp_path):
    html = browse(url, SIZES["desk"], tmp_path, "--dump-dom")
    text = text_of(html)
    assert "1 of 2 cameras deliver" in text
    gate, _, yard = text.partition("yard waiting")
    for fact in (
        "gate running rtsp://***@10.0.0.7:554/stream",
        "tracks now 2",
        "frames/s in 25.0",
        "frames/s tracked 24.6",
        "latency p50 41 ms",
        "latency p99 89 ms",
        "dropped 120",
        "stalls 1",
        "reconnects 2",
        "process restarts 3",
        "not written rerun 7",
        "north left 12",
        "7 confirmed 311 180 100",
        "the camera said",
    ):
        assert fact in gate
    assert "last frame 73 s ago" in yard
    assert "<b>stop</b>" not in html  # what a camera says is text, never markup


@pytest.mark.parametrize("name", SIZES)
def test_the_picture_fills_the_width_and_nothing_overflows(url, tmp_path, name):
    width, height = SIZES[name]
    file = tmp_path / "shot.png"
    browse(url, SIZES[name], tmp_path, f"--screenshot={file}")
    shot = cv2.imread(str(file)).astype(int)
    assert shot.shape[:2] == (height, width)
    made_up = np.abs(shot - 90).max(axis=2) < 6  # the camera's grey
    columns = np.flatnonzero(made_up.sum(axis=0) > 100)
    card, left = (width, 0) if name == "phone" else (width / 2, width / 2)  # the camera that does not deliver is first
    assert columns[0] < left + 40
    assert np.ptp(columns) > 0.8 * card
    edge = shot[:, -8:]  # the margin at the right is empty
    assert np.abs(edge - edge[0, 0]).max() < 8


def test_what_is_no_longer_true_is_no_longer_believed(tmp_path):
    """The program fails while the page is open."""
    with page_over({"gate": FailsSoon()}) as url:
        html = browse(url, SIZES["phone"], tmp_path, "--dump-dom")
    assert "no answer from vidtrack at" in text_of(html)
    assert "tracks now 2" in text_of(html)
    assert '<article class="">' in html


def test_the_token_reaches_everything_that_the_page_loads(tmp_path):
    camera = MadeUp()
    with page_over({"gate": camera}, token="sesame") as url:
        html = browse(url.replace("://", "://any:sesame@"), SIZES["phone"], tmp_path, "--dump-dom")
        assert "gate running" in text_of(html)
        assert camera.pictures > 0
        assert "gate running" not in text_of(browse(url, SIZES["phone"], tmp_path, "--dump-dom"))
