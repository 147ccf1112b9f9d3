"""The page of a site in a real browser: a junction drawn from nothing, by mouse and by keyboard."""

import json
from collections import Counter

import cv2
import numpy as np
import pytest
from browser import browser, needs_browser
from drawn_runs import along, write_run
from site_desk import SESAME, ask_json, desk_over

from vidtrack.serve.site.app import Picture
from vidtrack.serve.site.plan import read_world
from vidtrack.traffic.measures.measure import measured
from vidtrack.traffic.site import read_site

pytestmark = needs_browser

# Lanes of a junction, driven on the right, in pixels; and how many vehicles go from leg to leg.
INTO = {"west": (10, 235), "east": (630, 205), "north": (300, 10), "south": (330, 470)}
OUT_OF = {"west": (10, 205), "east": (630, 235), "north": (330, 10), "south": (300, 470)}
TRIPS = {("west", "east"): 3, ("west", "south"): 2, ("east", "west"): 2, ("north", "south"): 1, ("south", "west"): 1}
GATES = {
    "west in": ((100, 222), (100, 250)),
    "west out": ((100, 190), (100, 218)),
    "east in": ((530, 190), (530, 218)),
    "east out": ((530, 222), (530, 250)),
    "north in": ((285, 80), (313, 80)),
    "north out": ((317, 80), (345, 80)),
    "south in": ((317, 400), (345, 400)),
    "south out": ((285, 400), (313, 400)),
}
POINTS = [(20, 20), (620, 20), (620, 460), (20, 460), (200, 100), (420, 380)]
READY = (  # two pictures later: what was just done has been asked about
    "new Promise(done => requestAnimationFrame(() => requestAnimationFrame(() => "
    "done(document.querySelector('#state').dataset.busy === 'false'))))"
)


def driven(track, start_s, begin, end):
    """A vehicle from one lane to another at 50 px/s, 5 m/s; it turns within 2 s, with 4 m/s2."""
    corner = (end[0], begin[1]) if abs(begin[0] - 315) > 100 else (begin[0], end[1])
    points = np.array([begin, corner, end], float)
    way = np.append(0, np.cumsum(np.hypot(*np.diff(points, axis=0).T)))
    t = np.arange(0, way[-1] / 50, 0.04)
    around = t[:, None] + np.linspace(-1, 1, 51)
    x, y = (np.interp(50 * around, way, coordinate).mean(axis=1) for coordinate in points.T)
    return along(track, start_s + t, x, y)


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    ways = [way for way, count in TRIPS.items() for _ in range(count)]
    tracks = [driven(k, 1.0 + 15 * k, INTO[a], OUT_OF[b]) for k, (a, b) in enumerate(ways)]
    return write_run(tmp_path_factory.mktemp("junction") / "run", tracks, metres=True, covariances=True)


@pytest.fixture(scope="module")
def tab(tmp_path_factory):
    with browser(tmp_path_factory.mktemp("browser")) as tab:
        yield tab


def jpeg(scale):
    """The junction from above."""
    picture = np.full((480, 640, 3), 70, np.uint8)
    cv2.rectangle(picture, (0, 188), (639, 252), (120, 120, 120), -1)
    cv2.rectangle(picture, (283, 0), (347, 479), (120, 120, 120), -1)
    return cv2.imencode(".jpg", cv2.resize(picture, None, fx=scale, fy=scale))[1].tobytes()


class Page:
    """The open page, in the coordinates of its pictures."""

    def __init__(self, tab, url):
        self.tab, self.url = tab, url
        tab.open("about:blank")
        tab.open(f"{url}#{SESAME}")
        self.ready()

    def ready(self):
        self.tab.until(READY)

    def at(self, x, y, pane="scene"):
        """Where a point of a picture is in the window."""
        return self.all_at([(x, y)], pane)[0]

    def all_at(self, points, pane="scene"):
        """Where points of a picture are in the window."""
        pane = f"document.querySelector('#{pane}')"
        view, left, top = self.tab.js(
            f"(({{left, top}}) => [{pane}.dataset.view, left, top])({pane}.getBoundingClientRect())"
        )
        k, x0, y0 = map(float, view.split(","))
        return [(left + x0 + k * (x + 0.5), top + y0 + k * (y + 0.5)) for x, y in points]

    def write(self, key, text):
        """Type into the input with this key, in place of what is there."""
        self.tab.click_on(f"[data-key={json.dumps(key)}]")
        self.tab.js("document.activeElement.select()")
        self.tab.type(text)
        self.tab.press("Enter")

    def choose(self, key, value):
        self.tab.js(
            f"(one => {{ one.value = {json.dumps(value)}; one.dispatchEvent(new Event('change')); }})"
            f"(document.querySelector('[data-key={json.dumps(key)}]'))"
        )

    def text(self, selector):
        return self.tab.js(f"document.querySelector({json.dumps(selector)}).innerText")

    def has(self, selector):
        """Whether an element is there and shown."""
        return self.tab.js(f"Boolean(document.querySelector({json.dumps(selector)})?.getClientRects().length)")

    def save(self):
        self.tab.press("s", "Control")
        self.ready()
        self.tab.until("document.querySelector('#state').textContent === 'saved'")

    def counts(self):
        """The counts beside the gates' names."""
        rows = self.tab.js(
            "[...document.querySelectorAll('#gates .row')].map(one => "
            "[one.querySelector('.name').textContent, one.querySelector('.counts').textContent])"
        )
        return {name: Counter(int(word) for word in text.split() if word.isdigit()) for name, text in rows}


def test_a_junction_from_nothing_has_the_right_sheet(tab, run, tmp_path):
    site, plan = tmp_path / "site.toml", tmp_path / "plan.png"
    scene = Picture("scene.jpg", jpeg(1), "image/jpeg")
    tab.size(1440, 900)
    with desk_over(run, site, scene, (plan, Picture("plan.png", jpeg(0.5), "image/jpeg"))) as url:
        page = Page(tab, url)
        tab.press("p")
        tab.click(*page.at(0, 239, "plan"))
        tab.click(*page.at(100, 239, "plan"))
        tab.until("document.activeElement.name === 'length'")
        tab.type("20")
        tab.press("Enter")
        tab.until("document.querySelector('#scale').hidden")
        for k, (x, y) in enumerate(POINTS):
            tab.click(*page.at(x, y))
            tab.click(*page.at(x / 2 - 0.25, y / 2 - 0.25, "plan"))
            if k == 2:
                page.ready()
                tab.until("document.querySelector('#faults').innerText.includes('3 pairs of points; a plane needs')")
                assert tab.js("document.querySelector('#save').disabled")
        page.ready()
        assert "Grid of 5 m" in page.text("#points")
        assert not page.has("#faults li")
        assert tab.js("document.querySelectorAll('#scene .grid').length") > 15
        tab.press("g")
        for name, (start, end) in GATES.items():
            tab.drag(*page.all_at([start, ((start[0] + end[0]) / 2, (start[1] + end[1]) / 2), end]))
            tab.until("Boolean(document.querySelector('[data-key=\"gate name gate 1\"]'))")
            page.write("gate name gate 1", name)
            leg, role = name.split()
            tab.until(f"Boolean(document.querySelector('[data-key=\"gate leg {name}\"]'))")
            page.write(f"gate leg {name}", leg)
            page.choose(f"gate role {name}", {"in": "entry", "out": "exit"}[role])
        page.ready()
        tab.until("document.querySelectorAll('#movements tbody tr').length === 4")
        page.ready()
        assert "9 whole trips of 9" in page.text("#movements")
        tab.click_on("#movements button[title='west to east']")
        tab.until("document.querySelector('#movements button[title=\"west to east\"]').ariaPressed === 'true'")
        tab.until("document.querySelectorAll('#movements button.impossible').length === 4")
        assert tab.js("getComputedStyle(document.querySelector('#movements .impossible')).color !== ''")
        tab.press("z", "Control")
        shown = page.counts()
        page.save()
    found = measured([run], read_site(site))
    trips = Counter((row["from_leg"], row["to_leg"]) for row in found.tables["trips"].to_pylist() if row["complete"])
    assert trips == TRIPS
    assert [entry["trips"] for entry in found.report["movements"]] == [TRIPS[pair] for pair in sorted(TRIPS)]
    crossed = Counter(row["gate"] for row in found.tables["crossings"].to_pylist())
    assert {name: max(count) for name, count in shown.items()} == {name: crossed[name] for name in GATES}
    assert read_world(plan) == pytest.approx((0.2, 0, 0, -0.2, 0, 0.2 * 239), abs=1e-3)


DRAWN = """[site]  # of the works
name = "yard"
width = 640
height = 480
[gates.west]
line = [[100, 190], [100, 250]]
role = "entry"
[gates.east]
line = [[530, 190], [530, 250]]
role = "exit"
"""


@pytest.fixture
def page(tab, run, tmp_path):
    """A page over a site with two gates; its file is `page.site`."""
    site = tmp_path / "site.toml"
    site.write_text(DRAWN)
    tab.size(1440, 900)
    with desk_over(run, site, Picture("scene.jpg", jpeg(1), "image/jpeg")) as url:
        page = Page(tab, url)
        page.site = site
        yield page


def test_counts_follow_a_gate_while_it_is_dragged(page):
    tab = page.tab
    assert page.counts()["west"] == Counter({5: 1, 3: 1})
    start = page.at(100, 200)
    tab.mouse("Moved", *start)
    tab.mouse("Pressed", *start, button="left", buttons=1, clickCount=1)
    tab.mouse("Moved", *page.at(110, 260), button="left", buttons=1)
    tab.mouse("Moved", *page.at(110, 300), button="left", buttons=1)
    tab.until("document.querySelector('#gates .counts').textContent.replace(/[^0-9]+/g, ' ').trim() === '0 0'")
    tab.mouse("Released", *page.at(110, 300), button="left", clickCount=1)
    tab.press("z", "Control")
    page.ready()
    assert page.counts()["west"] == Counter({5: 1, 3: 1})
    tab.press("Z", "Control", "Shift")
    page.ready()
    page.save()
    assert read_site(page.site).gates["west"].line == ((110, 290), (110, 350))
    assert page.site.read_text().startswith("[site]  # of the works\n")


def test_corners_snap_and_can_be_added_and_taken_away(page):
    tab = page.tab
    tab.press("g")
    near = page.at(102, 188)  # beside a corner of another gate
    tab.drag(near, page.at(150, 150), page.at(203, 151))
    page.ready()
    tab.press("v")
    tab.drag(page.at(151.5, 170.5), page.at(150, 200), page.at(160, 240))  # the dot in the middle
    tab.press("g")
    tab.click(*page.at(400, 300), "Alt")
    tab.click(*page.at(480, 310), "Shift")
    tab.press("Enter")
    page.ready()
    page.save()
    gates = read_site(page.site).gates
    first, corner, last = gates["gate 1"].line
    assert first == (100, 190)
    assert np.allclose([corner, last], [(160, 240), (203, 151)], atol=1)
    (x1, y1), (x2, y2) = gates["gate 2"].line
    assert (abs(x1 - 400) < 1, y1 == y2, abs(x2 - 480) < 1) == (True, True, True)
    tab.press("v")
    tab.click(*page.at(130, 215))
    tab.click(*page.at(*corner))
    tab.press("Delete")
    page.ready()
    page.save()
    assert read_site(page.site).gates["gate 1"].line == (first, last)
    tab.press("Delete")
    page.ready()
    page.save()
    assert set(read_site(page.site).gates) == {"west", "east", "gate 2"}


def test_the_keyboard_alone_draws_moves_and_zooms(page):
    tab = page.tab
    tab.js("document.querySelector('#scene').focus()")
    tab.press("z")
    for keys in ("ArrowRight", "ArrowDown", "ArrowLeft"):
        tab.press(" ") if keys != "ArrowRight" else None
        for _ in range(12):
            tab.press(keys)
    tab.press(" ")
    tab.press("Enter")
    page.ready()
    tab.press("Escape")
    for key in (".", "ArrowLeft", "ArrowLeft", "+", "+", "0", "t", "m"):
        tab.press(key)
    page.ready()
    page.save()
    first, second, third = np.array(read_site(page.site).zones["zone 1"].polygon)
    length = 120 / float(tab.js("document.querySelector('#scene').dataset.view").split(",")[0])
    assert second - first == pytest.approx((2, length), abs=0.3)  # the first corner went 2 px to the left
    assert third - second == pytest.approx((-length, 0), abs=0.3)


def test_a_file_that_somebody_else_changed_is_not_written_over(page):
    tab = page.tab
    tab.click(*page.at(100, 200))
    tab.press("ArrowRight")
    theirs = DRAWN.replace('"yard"', '"theirs"')
    page.site.write_text(theirs)
    tab.press("s", "Control")
    tab.until("document.querySelector('#banners').innerText.includes('changed by somebody else')")
    assert page.site.read_text() == theirs
    tab.click_on("#banners button")
    tab.until("document.querySelector('#title').textContent === 'theirs'")
    tab.press("z", "Control")  # ours is not lost
    tab.until("document.querySelector('#title').textContent === 'yard'")
    page.save()
    assert read_site(page.site).gates["west"].line == ((101, 190), (101, 250))


def test_a_second_window_is_told_of_the_first(page):
    ask_json(page.url, "here", {"editor": "another", "open": True})
    page.tab.until("document.querySelector('#banners').innerText.includes('open in another window')")


def test_names_are_text_and_never_markup(page):
    tab = page.tab
    tab.click_on("#gates .row")
    tab.until("Boolean(document.querySelector('[data-key=\"gate name west\"]'))")
    name = "<img src=x onerror=alert(1)>"
    page.write("gate name west", name)
    tab.until("document.querySelector('#faults').innerText.includes('a name begins with a letter')")
    assert name in page.text("#gates")
    assert name in tab.js("document.querySelector('#scene svg').textContent")
    assert not page.has("#panel img, svg img")
    assert tab.js("document.querySelector('#save').disabled")
    tab.press("s", "Control")
    tab.until("document.querySelector('#banners').innerText.includes('a name begins with a letter')")
    assert page.site.read_text() == DRAWN
    assert not page.has("#banners img")


def test_metres_can_be_typed_without_a_plan(page):
    tab = page.tab
    tab.press("p")
    for x, y in POINTS:
        tab.click(*page.at(x, y))
    tab.until("document.querySelectorAll('#points tbody tr').length === 6")
    tab.click_on("[data-key='pair 0 0']")
    for x, y in POINTS:
        tab.type(f"{x / 10}".replace(".", ","))  # as in German
        tab.press("Tab")
        page.ready()
        tab.type(f"{48 - y / 10}")
        for _ in range(3):  # over the cross and the number of the next point
            tab.press("Tab")
            page.ready()
    page.ready()
    assert "Grid of 5 m" in page.text("#points")
    page.save()
    assert read_site(page.site).calibration.ground[1] == (62, 46)
    assert read_site(page.site).calibration.picture[1] == pytest.approx((620, 20), abs=0.5)


def test_what_is_typed_is_saved_by_the_keys_alone(page):
    tab = page.tab
    tab.click_on("[data-key='site name']")
    tab.js("document.activeElement.select()")
    tab.type("Quay 7")
    page.save()
    assert read_site(page.site).camera.name == "Quay 7"


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
def test_nothing_overflows_on_a_phone(page, dark):
    tab = page.tab
    tab.size(390, 844, dark)
    tab.until("document.documentElement.clientWidth === 390")
    assert tab.js("document.documentElement.scrollWidth") == 390
    assert tab.js("document.documentElement.scrollHeight") == 844
    scene, panel = (
        tab.js(f"(({{width, height}}) => [width, height])(document.querySelector('{one}').getBoundingClientRect())")
        for one in ("#scene", "#panel")
    )
    assert scene[0] == panel[0] == 390
    assert min(scene[1], panel[1]) > 250
    colours = tab.js("getComputedStyle(document.body).backgroundColor")
    assert (sum(map(int, colours[4:-1].split(","))) < 200) == dark


def test_without_the_token_nothing_is_shown(page):
    tab = page.tab
    tab.open("about:blank")
    tab.open(page.url)
    tab.until("document.querySelector('#state').textContent.includes('the token is missing')")
