"""The page of `vidtrack review`: clips, verdicts, missed vehicles, and what it refuses."""

import csv
import json
import urllib.error
import urllib.request
from contextlib import contextmanager

import cv2
import numpy as np
import pytest
from browser import browser, needs_browser
from command_line import start
from counted_run import WHITE, write_measures, write_run, write_video
from page_client import HANG_S

from vidtrack.output.clips import HEIGHT, WIDTH, Clips
from vidtrack.output.corrections import NAME, CorrectionsFile, read_corrections
from vidtrack.serve.access import TOKEN, private
from vidtrack.serve.listener import listen, url_of
from vidtrack.serve.review import Review
from vidtrack.serve.server import Server
from vidtrack.traffic.validation.audit import Correction
from vidtrack.traffic.validation.audit_events import doubtful_order, random_order, read_counted

NASTY = "<img src=x onerror=alert(1)>"
OTHER = "&amp; out"


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    path = tmp_path_factory.mktemp("video") / "car.mp4"
    write_video(path)
    return path


@pytest.fixture
def measures(tmp_path, video):
    return write_measures(tmp_path / "measures", write_run(tmp_path / "run", video))


class Client:
    """What a program may ask of the page at `url`."""

    def __init__(self, url):
        self.url = url

    def get(self, path):
        """Status code, headers and body."""
        return self._ask(urllib.request.Request(self.url + path))

    def post(self, path, **change):
        """Status code, and the new state or why there is none."""
        request = urllib.request.Request(self.url + path, json.dumps(change).encode(), {"Origin": self.url.rstrip("/")})
        code, _, body = self._ask(request)
        return code, json.loads(body) if code == 200 else body.decode().strip()

    def _ask(self, request):
        request.add_header(TOKEN, "sesame")
        try:
            with urllib.request.urlopen(request, timeout=HANG_S) as answer:
                return answer.status, answer.headers, answer.read()
        except urllib.error.HTTPError as error:
            return error.code, error.headers, error.read()


@contextmanager
def served(folder, sample=None):
    """A client of the page over a folder, whose address for a browser is `client.url` + "#sesame"."""
    counted = read_counted(folder)
    order = (doubtful_order if sample is None else random_order)(counted.events)[:sample]
    page = Review(
        folder.name, counted, CorrectionsFile(folder), Clips(counted, None), order.tolist(), sample is not None
    )
    listener = listen("0", None)
    server = Server(listener)
    server.start(private(page.app(), "sesame"))
    try:
        yield Client(url_of(listener))
    finally:
        server.close()


def test_a_clip_shows_the_moment_of_passing(measures):
    """The white car is in the middle of the gate's line in the picture that passes."""
    counted = read_counted(measures)
    (event,) = (one for one in counted.events if (one.gate, one.track_id) == ("middle", 1))
    clip = Clips(counted, None).clip(event)
    strip = cv2.imdecode(np.frombuffer(clip.strip, np.uint8), cv2.IMREAD_COLOR)
    assert strip.shape == (HEIGHT, WIDTH * clip.frames, 3)
    assert clip.frames == 13
    starts = []
    for k in range(clip.frames):
        white = (strip[:, k * WIDTH : (k + 1) * WIDTH].min(axis=2) > WHITE - 20).sum(axis=0) > 10
        starts.append(np.flatnonzero(white)[0])
    steps = np.diff(starts)
    assert (steps > 0).all()  # it drives to the right in each picture
    assert clip.moment == 6
    thumb = cv2.imdecode(np.frombuffer(clip.thumb, np.uint8), cv2.IMREAD_COLOR)
    assert thumb.shape == (90, 160, 3)
    assert (thumb.min(axis=2) > WHITE - 20).sum() > 50


def test_events_come_with_all_that_is_known(measures):
    with served(measures) as client:
        found = json.loads(client.get("events")[2])
        assert (found["name"], found["total"], found["sampled"], found["no_clips"]) == ("measures", 4, False, "")
        assert found["ways"] == {"middle": ["right", "left"], "late": ["right", "left"]}
        assert [event["track_id"] for event in found["events"]] == [2, 2, 1, 1]  # merged, and behind another
        first = found["events"][0]
        assert (first["gate"], first["direction"], first["reason"]) == ("middle", "right", "merged")
        assert first["headway_s"] == pytest.approx(0.08, abs=1e-3)
        code, headers, body = client.get(f"clips/{first['number']}.jpg")
        assert (code, headers["Clip-Frames"], body[:2]) == (200, "13", b"\xff\xd8")
        assert client.get("clips/99.jpg")[0] == 404
        second = found["events"][2]
        rows = json.loads(client.get(f"decisions/{second['number']}")[2])
        assert [row["event"] for row in rows] == ["birth", "update"]
        assert rows[1]["d2"] == 0.25


def test_times_are_those_of_the_site(tmp_path, video):
    """As in the report: of its zone, which the page names."""
    run = write_run(tmp_path / "run", video, [("line", 100)])
    with served(write_measures(tmp_path / "measures", run, "2026-06-01T23:59:58+02:00")) as client:
        found = json.loads(client.get("events")[2])
        assert found["zone"] == "UTC+02:00"
        first = min(found["events"], key=lambda one: one["time_s"])
        assert (round(first["time_s"], 1), first["clock"]) == (2.4, "00:00:00.4")
        state = client.post("missed", changes=0, time_s=62.04, gate="middle", direction="right")[1]
        assert [one["clock"] for one in state["missed"]] == ["00:01:00.0"]
    with served(run) as client:
        assert json.loads(client.get("events")[2])["zone"] == "hours after the first picture"
    (run / "site.toml").write_text((tmp_path / "measures" / "site.toml").read_text())
    with served(run) as client:
        assert json.loads(client.get("events")[2])["zone"] == "UTC+02:00"


def test_verdicts_are_kept_beside_the_counts(measures):
    before = {path.name: path.read_bytes() for path in measures.iterdir()}
    with served(measures) as client:
        code, state = client.post("verdict", changes=0, number=1, verdict="double")
        assert code == 200
        assert state["verdicts"] == {"1": "double"}
        assert state["all"]["corrected"] == 3
        _, state = client.post("verdict", changes=1, number=0, verdict="right")
        _, state = client.post("missed", changes=2, time_s=5.5, gate="late", direction="left")
        assert state["missed"] == [{"time_s": 5.5, "clock": "0:00:05.5", "gate": "late", "direction": "left"}]
        assert [(way["counted"], way["corrected"]) for way in state["ways"]] == [(2, 1), (0, 0), (2, 2), (0, 1)]
        assert len(read_corrections(measures)) == 3
        client.post("missed", changes=3, number=0)
        _, state = client.post("verdict", changes=4, number=0, verdict=None)
        assert state["verdicts"] == {"1": "double"}
    (row,) = read_corrections(measures)
    assert (row.verdict, row.gate, row.direction, row.track_id) == ("double", "middle", "right", 2)
    assert {name: (measures / name).read_bytes() for name in before} == before
    with served(measures) as client:
        assert json.loads(client.get("events")[2])["state"]["verdicts"] == {"1": "double"}


@pytest.mark.parametrize(
    ("path", "change", "code"),
    [
        ("verdict", {"changes": 0, "number": 0, "verdict": "fine"}, 400),
        ("verdict", {"changes": 0, "number": 4, "verdict": "right"}, 404),
        ("verdict", {"changes": 0, "number": None, "verdict": "right"}, 404),
        ("verdict", {"changes": 3, "number": 0, "verdict": "right"}, 409),
        ("verdict", {"number": 0, "verdict": "right"}, 409),
        ("missed", {"changes": 0, "time_s": "noon", "gate": "middle", "direction": "left"}, 400),
        ("missed", {"changes": 0, "time_s": 1, "gate": "middle", "direction": "up"}, 400),
        ("missed", {"changes": 0, "time_s": 1, "gate": ["middle"], "direction": "left"}, 400),
        ("missed", {"changes": 0, "number": 0}, 404),
    ],
)
def test_what_is_no_change_is_refused(measures, path, change, code):
    with served(measures) as client:
        assert client.post(path, **change)[0] == code
    assert not (measures / NAME).exists()


def test_a_file_that_somebody_else_changed_is_not_overwritten(measures):
    with served(measures) as client:
        (measures / NAME).write_text("mine")
        code, why = client.post("verdict", changes=0, number=0, verdict="right")
        assert (code, why) == (409, "corrections.csv was changed by another program; start vidtrack review again")
        assert (measures / NAME).read_text() == "mine"


def test_without_its_video_there_are_rows_and_no_pictures(tmp_path):
    folder = write_run(tmp_path / "run", tmp_path / "gone.mp4", [("gate", 160)])
    with served(folder) as client:
        found = json.loads(client.get("events")[2])
        assert len(found["events"]) == 2
        assert "no such file" in found["no_clips"]
        code, _, why = client.get("clips/0.jpg")
        assert code == 404
        assert b"no such file" in why
        assert client.post("verdict", changes=0, number=0, verdict="right")[0] == 200


def test_a_run_that_has_moved_away_still_has_its_measures(measures):
    (measures.parent / "run").rename(measures.parent / "elsewhere")
    with served(measures) as client:
        found = json.loads(client.get("events")[2])
        assert len(found["events"]) == 4
        assert "no longer where they were measured" in found["no_clips"]


def test_a_sample_is_random_and_of_so_many(measures):
    with served(measures, sample=3) as client:
        found = json.loads(client.get("events")[2])
    assert found["sampled"]
    numbers = [event["number"] for event in found["events"]]
    assert numbers == random_order(read_counted(measures).events).tolist()[:3]


@needs_browser
def test_one_looks_and_judges_by_keys(tmp_path, video):
    """Verdicts, next and previous, undo, a missed vehicle and its undo; names that are markup."""
    folder = write_run(tmp_path / "run", video, [(NASTY, 100), (OTHER, 200)])
    with served(folder) as client, browser(tmp_path) as tab:
        tab.open(client.url + "#sesame")
        tab.until("document.querySelectorAll('#list li').length === 4 && clip && rows.every((row) => !wanted.has(row))")
        assert tab.js("document.querySelector('#what').textContent").startswith(NASTY)
        assert tab.js("document.querySelectorAll('img').length") == 0
        shown = "Array.from(document.querySelectorAll('.verdict'), (one) => one.textContent)"
        current = "rows.findIndex((row) => row.hasAttribute('aria-current'))"
        assert tab.js(current) == 0
        for keys, verdicts, place_after in (
            ("2", ["double", "", "", ""], 1),
            ("r", ["double", "right", "", ""], 2),
            ("kw", ["double", "wrong", "", ""], 2),
            ("z", ["double", "right", "", ""], 1),
            ("z", ["double", "", "", ""], 1),
            ("jj", ["double", "", "", ""], 3),
            ("v", ["double", "", "", "no vehicle"], 3),
        ):
            for key in keys:
                tab.press(key)
                tab.until("!busy")
            tab.until(f"JSON.stringify({shown}) === {json.dumps(json.dumps(verdicts, separators=(',', ':')))}")
            tab.until(f"{current} === {place_after}")
        tab.press("m")
        tab.js("document.querySelector('[name=time_s]').select()")
        tab.type("1.5")
        tab.press("Enter")
        tab.until("state.missed.length === 1")
        assert tab.js("document.querySelector('#missed li').firstChild.textContent").startswith("0:00:01.5 ·")
        assert tab.js("document.querySelector('#zone').textContent") == "Times: hours after the first picture"
        assert tab.js("document.querySelector('#progress').textContent") == "2 of 4 looked at · 2 false · 1 missed"
        tab.js("document.activeElement.blur()")
        tab.press("z")
        tab.until("state.missed.length === 0")
        tab.press(" ")
        tab.js("document.getElementById('decisions').open = true")
        tab.until("document.querySelectorAll('#decisions tbody tr').length > 0")
        for width, height in ((1440, 900), (390, 844)):
            tab.size(width, height)
            assert tab.js("document.documentElement.scrollWidth") <= width
        assert tab.js("document.querySelector('#clip').getContext('2d').getImageData(320, 180, 1, 1).data[3]") == 255
    with (folder / NAME).open(encoding="utf-8-sig", newline="") as file:
        rows = list(csv.DictReader(file))
    assert {row["verdict"] for row in rows} == {"double", "no vehicle"}
    assert {row["gate"] for row in rows} == {NASTY, OTHER}


@needs_browser
def test_two_tabs_the_second_is_told(tmp_path, measures):
    with served(measures) as client, browser(tmp_path) as tab:
        tab.open(client.url + "#sesame")
        tab.until("document.querySelectorAll('#list li').length === 4")
        client.post("verdict", changes=0, number=3, verdict="right")
        tab.press("r")
        tab.until("document.querySelector('#trouble').textContent.startsWith('another tab changed something')")
        assert tab.js("Object.values(state.verdicts).join()") == "right"
        tab.press("w")
        tab.until("Object.keys(state.verdicts).length === 2")
        assert tab.js("document.querySelector('#trouble').hidden")


def test_the_command_serves_and_ends(measures):
    process = start("review", "measures", "--sample", "2", cwd=measures.parent)
    try:
        url, _, token = process.stdout.readline().strip().partition("#")
        request = urllib.request.Request(url + "events", headers={TOKEN: token})
        with urllib.request.urlopen(request, timeout=HANG_S) as answer:
            assert len(json.load(answer)["events"]) == 2
        with pytest.raises(urllib.error.HTTPError, match="401"):
            urllib.request.urlopen(url + "events", timeout=HANG_S)
        second = start("review", "measures", cwd=measures.parent)
        assert "is in use by another run" in second.communicate(timeout=HANG_S)[1]
        assert second.returncode == 2
        process.terminate()
        _, err = process.communicate(timeout=HANG_S)
    finally:
        process.kill()
    assert process.returncode == 0
    assert "0 corrections in measures/corrections.csv" in err


def test_validate_tells_the_precision_of_the_sample(measures, vidtrack):
    order = random_order(events := read_counted(measures).events).tolist()
    verdicts = dict(zip(order, ["right", "double", "right"], strict=False))
    CorrectionsFile(measures).replace(
        [Correction(verdict, *(getattr(events[k], name) for name in ("time_s", "gate", "direction", "run", "track_id")))
         for k, verdict in verdicts.items()]
    )  # fmt: skip
    code, out, err = vidtrack("validate", "measures", "--json", "-")
    assert code == 0, err
    pooled = json.loads(out)["pooled"]
    assert (pooled["counted"], pooled["looked_at"], pooled["corrected"], pooled["sample"]) == (4, 3, 3, 3)
    assert pooled["precision"]["value"] == pytest.approx(2 / 3)
    for arguments, words in (
        (("run",), "holds no crossings.csv or counts.csv"),
        (("measures", "--start", "0"), "for a count by hand"),
    ):
        _, _, err = vidtrack("validate", *arguments)
        assert words in err
        assert err.count("\n") == 1
