"""The page in a real browser, on a telephone, without a network."""

import re
import shutil
import subprocess

import numpy as np
import pytest
from browser import browser
from made_up_day import MOVEMENTS, write_day

from vidtrack.output.report.report import write_report
from vidtrack.traffic.report.findings import read_findings

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser") or shutil.which("google-chrome")

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason="needs Chromium (Debian's package chromium)")


@pytest.fixture
def out(tmp_path):
    """The folder of a report."""
    write_day(tmp_path / "day", np.ones((4, 12)), speeds=np.arange(40), legs=MOVEMENTS)
    folder = tmp_path / "report"
    folder.mkdir()
    write_report(folder, read_findings(tmp_path / "day"), None)
    return folder


def test_every_picture_shows_and_nothing_is_wider_than_the_screen(tmp_path, out):
    page = (out / "report.html").read_text(encoding="utf-8")
    look = (
        "<script>addEventListener('load', () => { const images = [...document.images];"
        "document.title = `pictures ${images.filter(one => one.naturalWidth > 0).length} of ${images.length}, "
        "wide ${document.documentElement.scrollWidth}`; })</script>"
    )
    # the page forbids scripts; this copy allows the one that looks at it
    page = page.replace("default-src 'none';", "default-src 'none'; script-src 'unsafe-inline';")
    (out / "looked-at.html").write_text(page.replace("</body>", look + "</body>"), encoding="utf-8")
    command = [CHROMIUM, "--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars", "--disable-dev-shm-usage"]
    command += [
        f"--user-data-dir={tmp_path / 'profile'}",
        "--window-size=500,1200",
        "--host-resolver-rules=MAP * ~NOTFOUND",
    ]
    command += ["--dump-dom", (out / "looked-at.html").as_uri()]
    dom = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True).stdout
    seen, images, width = map(int, re.search(r"<title>pictures (\d+) of (\d+), wide (\d+)", dom).groups())
    assert (seen, images) == (4, 4)  # nobody queues, so that there is no chart of queues
    assert width <= 500


def test_no_table_is_cut_on_a_telephone(tmp_path, out):
    """The sheet stands there leg by leg, all of it on a wider screen and on paper."""
    hidden = "[...document.querySelectorAll('.wide')].filter((one) => one.scrollWidth > one.clientWidth).length"
    sheets = "[...document.querySelectorAll('.sheet')].filter((one) => one.checkVisibility()).length"
    with browser(tmp_path) as tab:
        tab.open((out / "report.html").as_uri())
        for width, shown in ((390, 1), (1280, 1)):
            tab.size(width, 844)
            assert tab.js(hidden) == 0
            assert tab.js(sheets) == shown
        tab.size(390, 844)
        legs = tab.js("[...document.querySelectorAll('.by-leg summary')].map((one) => one.textContent)")
        for leg in range(len(legs)):
            tab.js(f"document.querySelectorAll('.by-leg details')[{leg}].open = true")
        assert tab.js(sheets) == len(legs) > 1
        assert tab.js(hidden) == 0
        whole = tab.js("document.querySelector('.whole tfoot td:last-child').textContent")
        assert sum(int(leg.rpartition(": ")[2]) for leg in legs) == int(whole)
        tab.send("Emulation.setEmulatedMedia", media="print")
        assert tab.js(sheets) == 1


def test_pictures_are_whole_on_a_telephone_and_can_be_read_after_a_tap(tmp_path, out):
    """An enlarged picture scrolls sideways in its own place, and the page does not."""
    widths = "[...document.images].map((one) => one.getBoundingClientRect().width)"
    scrolls = "[...document.querySelectorAll('.picture')].map((one) => one.scrollWidth > one.clientWidth)"
    with browser(tmp_path) as tab:
        tab.open((out / "report.html").as_uri())
        tab.size(390, 844)
        assert max(tab.js(widths)) <= 390
        assert not any(tab.js(scrolls))
        tab.click_on(".picture")
        assert tab.js(widths)[0] >= 640
        assert tab.js(scrolls)[0]
        assert tab.js("document.documentElement.scrollWidth") <= 390
        tab.size(1280, 844)
        assert not any(tab.js(scrolls))
