"""The operator page in a real browser, at the sizes of a phone and of a desk."""

import json
import time

import pytest
from browser import browser, needs_browser
from page_client import MadeUp, page_over

from vidtrack.output.intervals.book import CountBook, Passage
from vidtrack.output.intervals.day import Plan

SIZES = {"phone": (390, 844), "desk": (1440, 900)}
NAN = float("nan")
TAG = "<b>stop</b>"

pytestmark = needs_browser


class NoPicture(MadeUp):
    def picture(self):
        return None


class FailsSoon(MadeUp):
    fails = False

    def status(self):
        if self.fails:
            raise ValueError("made up")
        return super().status()


@pytest.fixture(scope="module")
def tab(tmp_path_factory):
    with browser(tmp_path_factory.mktemp("browser")) as tab:
        yield tab


@pytest.fixture(scope="module")
def counted(tmp_path_factory):
    """Twelve vehicles in the last ten minutes, and seven more yesterday."""
    folder = tmp_path_factory.mktemp("counts")
    now_s = time.time()
    book = CountBook(folder, Plan({"north": ("left", "right")}, {}, None))
    book.add(Passage(now_s - 86400 - k, "north", "left", k, NAN, NAN, NAN, NAN) for k in range(7))
    book.add(Passage(now_s - 50 * k - 1, "north", "left", k, NAN, 10.0, 0.1, 0.1) for k in range(12))
    book.watch(now_s - 86500, now_s - 80000)
    book.watch(now_s - 7200, now_s)
    book.close()
    return folder


@pytest.fixture(scope="module")
def url(counted):
    """Three cameras; one does not deliver, and one has a name and lines that are markup."""
    gate = MadeUp(counts={"north": {"left": 19, "right": 0}})
    gate.counts = counted
    waiting = NoPicture(state="waiting", frame_age_s=73.0, problems=[(time.time(), "no route to host")])
    with page_over({"gate": gate, TAG: MadeUp(counts={TAG: {"up": 1, "down": 0}}), "yard": waiting}) as url:
        yield url


@pytest.fixture
def page(tab, url):
    tab.size(*SIZES["desk"])
    tab.open("about:blank")
    tab.open(url)
    tab.until("document.querySelector('.lines svg') !== null")
    return tab


def text(tab, selector="body"):
    return tab.js(f"document.querySelector({json.dumps(selector)}).innerText.replace(/\\s+/g, ' ')")


def test_one_camera_is_shown_with_all_that_is_known(tab, counted):
    camera = MadeUp(counts={"north": {"left": 19, "right": 3}})
    camera.counts = counted
    tab.size(*SIZES["desk"])
    with page_over({"gate": camera}) as url:
        tab.open(url)
        tab.until("document.querySelectorAll('.charts rect.first').length > 3")
        assert "the camera delivers" in text(tab, "body > header")
        assert not tab.js("document.querySelector('details').open")  # technical figures are folded away
        assert text(tab, ".counts tbody tr").split() == ["north", "←", "left", "12", text_today(tab), "19"]
        tab.until("document.querySelector('#one .picture img').naturalWidth === 640")
        tab.js("document.querySelector('details').open = true")
        shown = text(tab, "#one")
        for fact in (
            "rtsp://***@10.0.0.7:554/stream",
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
            "7 confirmed 311 180 100",
            'the camera said "<b>stop</b>"',
        ):
            assert fact in shown


def text_today(tab):
    """What was counted today depends on how long ago midnight is."""
    return tab.js("number(sum(cameras[0], 'today', 'north', 'left'))")


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("size", SIZES)
def test_a_camera_that_does_not_deliver_is_seen_at_once_and_nothing_overflows(page, size, dark):
    page.size(*SIZES[size], dark=dark)
    page.until(f"innerWidth === {SIZES[size][0]}")
    top, bottom = page.js(
        "(({top, bottom}) => [top, bottom])(document.querySelector('#alerts a').getBoundingClientRect())"
    )
    assert 0 <= top < bottom < SIZES[size][1] / 4
    assert text(page, "#alerts") == "yard waiting: no picture for 73 s: no route to host"
    assert text(page, "#summary") == "2 of 3 cameras deliver"
    cards = page.js("[...document.querySelectorAll('article')].map((card) => card.getBoundingClientRect().top)")
    assert cards[2] == min(cards)  # it is also the first of the wall
    assert page.js("document.documentElement.scrollWidth <= innerWidth")
    page.click_on("#alerts a")
    page.until("!document.getElementById('one').hidden")
    assert page.js("document.documentElement.scrollWidth <= innerWidth")


def test_a_camera_is_enlarged_by_a_click_and_all_come_back(page):
    page.click_on("article .picture")
    page.until("document.querySelectorAll('.charts rect.first').length > 3")
    assert page.js("location.hash") == "#gate"
    assert text(page, "#one h2").split() == ["gate", "running"]
    page.press("Escape")
    page.until("!document.getElementById('wall').hidden")
    page.js("history.back()")
    page.until("document.getElementById('wall').hidden")


def test_any_day_is_shown_and_can_be_downloaded(page):
    page.js("location.hash = 'gate'")
    page.until("document.querySelectorAll('.charts rect.first').length > 3")
    days = page.js("[...document.querySelector('.day').options].map((option) => option.value)")
    assert days[0] == ""
    assert days[1:] == sorted(days[1:], reverse=True)
    page.js("document.querySelector('.day').value = document.querySelector('.day').options[2].value")
    page.js("document.querySelector('.day').onchange()")
    page.until("document.querySelector('.charts .way b')?.textContent !== '12'")
    assert page.js("document.querySelector('.choices a').href").endswith(f"counts/0/{days[2]}.csv?every=15min")


def test_what_users_and_cameras_say_is_text_and_never_markup(page):
    assert page.js("document.querySelectorAll('b').length > 0")
    assert page.js("[...document.querySelectorAll('b')].every((one) => one.textContent !== 'stop')")
    assert TAG in text(page, "#wall")
    page.js(f"location.hash = encodeURIComponent({json.dumps(TAG)})")
    page.until("!document.getElementById('one').hidden")
    assert text(page, "#one h2 .name") == TAG
    assert page.js("[...document.querySelectorAll('b')].every((one) => one.textContent !== 'stop')")


def test_what_is_no_longer_true_is_no_longer_believed(tab):
    """The program fails while the page is open."""
    cameras = {"gate": FailsSoon(), "yard": MadeUp()}
    with page_over(cameras) as url:
        tab.open(url)
        tab.until("document.querySelectorAll('article.up').length === 2")
        FailsSoon.fails = True
        tab.until("document.getElementById('summary').textContent.startsWith('no answer from vidtrack at')")
        assert tab.js("document.querySelectorAll('.up').length") == 0
        assert tab.js("document.title") == "vidtrack (no answer)"


def test_the_token_reaches_everything_that_the_page_loads(tab):
    camera = MadeUp()
    with page_over({"gate": camera}, token="sesame") as url:
        tab.open(url.replace("://", "://any:sesame@"))
        tab.until("document.querySelector('#one .name')?.textContent === 'gate'")
        tab.until("document.querySelector('#one .picture img').naturalWidth === 640")
        assert camera.pictures > 0


def test_the_pictures_of_events_are_shown_with_their_time(tab, tmp_path):
    name = "2026-11-22T14-03-07.250-0123456789abcdef01234567.jpg"
    camera = MadeUp()
    camera.counts = tmp_path / "intervals"
    (tmp_path / "pictures" / "2026-11-22").mkdir(parents=True)
    (tmp_path / "pictures" / "2026-11-22" / name).write_bytes(camera.picture())
    with page_over({"gate": camera}) as url:
        tab.open(url)
        tab.until("document.querySelector('.events img')?.naturalWidth === 640")
        assert text(tab, ".events li") == "14:03:07"
        assert tab.js("document.querySelector('.events a').href").endswith(f"/camera/gate/pictures/2026-11-22/{name}")
