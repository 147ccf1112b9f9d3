"""A gate and a mask drawn in a real browser over a camera that runs: they are used without a restart."""

import json
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

from browser import browser, needs_browser
from live_runs import NEVER_ROLLS, play, rows, settings

from vidtrack.cli.site import SiteOptions, desk_of
from vidtrack.errors import SourceError
from vidtrack.recording.retention import parts_of
from vidtrack.run.live.run import LiveRun
from vidtrack.serve.access import private
from vidtrack.serve.listener import listen, url_of
from vidtrack.serve.server import Server
from vidtrack.traffic.measures.runs import parts_with_tracks
from vidtrack.traffic.site import read_site

TOKEN = "sesame"
READY = "document.querySelector('#state').dataset.busy === 'false'"


class Drawing:
    """The page over the folder of a run that goes on, in a browser."""

    def __init__(self, tab, folder):
        options = SiteOptions(run=folder, site=None, picture=None, plan=None, port=0, quiet=True, verbose=0)
        listener = listen("0", None)
        self.server, self.tab = Server(listener), tab
        self.server.start(private(desk_of(options).app(), TOKEN))
        tab.open("about:blank")
        tab.open(f"{url_of(listener)}#{TOKEN}")
        tab.until(READY)

    def at(self, x, y):
        """Where a point of the picture is in the window."""
        pane = "document.querySelector('#scene')"
        view, left, top = self.tab.js(
            f"(({{left, top}}) => [{pane}.dataset.view, left, top])({pane}.getBoundingClientRect())"
        )
        k, x0, y0 = map(float, view.split(","))
        return left + x0 + k * (x + 0.5), top + y0 + k * (y + 0.5)

    def save(self):
        self.tab.press("s", "Control")
        self.tab.until("document.querySelector('#state').textContent === 'saved'")


def has_tracks(folder):
    """Whether the page has something to open."""
    with suppress(SourceError):
        return parts_with_tracks(folder, parts_of(folder))


@needs_browser
def test_a_gate_counts_and_then_a_mask_ends_all(camera, tmp_path):
    """The gate is drawn at the size of a desk, the mask at that of a phone."""
    site, folder = tmp_path / "yard.toml", tmp_path / "out"
    site.write_text('[site]\nname = "yard"\nwidth = 320\nheight = 240\n')
    chosen = settings(NEVER_ROLLS, f"output.site={site}", "tracker.confirm_s=0.1")
    shown = []

    def gate(tab):
        page = Drawing(tab, folder)
        shown.append(tab.js("fetch('scene', {headers: {'X-Vidtrack-Token': 'sesame'}}).then((one) => one.status)"))
        tab.press("g")
        tab.drag(page.at(160, 4), page.at(160, 100), page.at(160, 235))
        tab.until(READY)
        page.save()
        return page

    def mask(page):
        tab = page.tab
        tab.size(390, 844)
        tab.until("innerWidth === 390")
        tab.press("0")
        tab.press("z")
        for corner in ((1, 1), (318, 1), (318, 238), (1, 238)):
            tab.click(*page.at(*corner))
        tab.press("Enter")
        use = "document.querySelector('[data-key=\"zone use zone 1\"]')"
        tab.until(f"Boolean({use})")
        tab.js(f"(one => {{ one.value = 'mask'; one.dispatchEvent(new Event('change')); }})({use})")
        tab.until(READY)
        page.save()
        tab.screenshot(tmp_path / "page.png")
        page.server.close()

    with browser(tmp_path) as tab, ThreadPoolExecutor(1) as hand, LiveRun(camera.url(), chosen, folder) as run:

        def story(seen):
            yield rows(20)
            yield lambda _: (folder / "scene.jpg").exists() and has_tracks(folder)
            drawn = hand.submit(gate, tab)
            yield lambda _: drawn.done()
            page = drawn.result()
            yield lambda _: sum(run.board.now().counts.get("gate 1", {}).values()) >= 3
            drawn = hand.submit(mask, page)
            yield lambda _: drawn.done()
            drawn.result()
            yield lambda seen: not any(one.tracks for one in seen[-30:])

        play(run, story)
        assert run._source.stats.reconnects == 0
    assert shown == [200]
    assert read_site(site).zones["zone 1"].tracked is False
    plan = json.loads((folder / "intervals" / "plan.json").read_text())
    assert list(plan["gates"]) == ["gate 1"]
    assert plan["spans"]["gate 1"][0][0] > 0
