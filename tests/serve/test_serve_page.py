"""The page answers browsers and programs, and only those who may know."""

import json
import logging
import urllib.request

import pytest
from page_client import HANG_S, MadeUp, connect, get, get_json, page_over
from prometheus_client.parser import text_string_to_metric_families

WAITING = {"state": "waiting", "frame_age_s": 73.0}


class NothingYet(MadeUp):
    """A camera that never answered."""

    def status(self):
        return {"source": self.source, "state": "connecting", "problems": []}

    def picture(self):
        return None


@pytest.fixture(scope="module")
def url():
    with page_over({"gate": MadeUp(), "yard": MadeUp(**WAITING), "roof": NothingYet()}) as url:
        yield url


def test_the_page_loads_nothing_foreign(url):
    for path in ("", "static/page.css", "static/page.js"):
        code, headers, body = get(url + path)
        assert code == 200
        assert b"://" not in body
        assert headers["Cache-Control"] == "no-store"
        assert "default-src 'self'" in headers["Content-Security-Policy"]


def test_the_status_of_all_cameras(url):
    gate, yard, roof = get_json(url + "status")
    assert (gate["name"], gate["up"], gate["source"]) == ("gate", True, "rtsp://***@10.0.0.7:554/stream")
    assert (yard["name"], yard["up"], yard["state"]) == ("yard", False, "waiting")
    assert roof == {"name": "roof", "up": False, "state": "connecting", "source": gate["source"], "problems": []}
    assert gate["reading"]["latency_ms"]["p95"] == 63.0
    assert gate["counts"]["north"] == {"left": 12, "right": 9}
    assert [track["track_id"] for track in gate["tracks"]] == [7, 12]


def test_pictures(url):
    code, headers, body = get(url + "picture/1.jpg")
    assert (code, headers["Content-Type"], body[:2]) == (200, "image/jpeg", b"\xff\xd8")
    assert get(url + "picture/2.jpg")[0] == 503
    assert get(url + "picture/3.jpg")[0] == 404
    assert get(url + "picture/x.jpg")[0] == 404


def test_health_names_who_does_not_deliver(url):
    code, _, body = get(url + "healthz")
    assert (code, body) == (503, b"yard: waiting\nroof: connecting\n")
    with page_over({"gate": MadeUp()}) as well:
        code, _, body = get(well + "healthz")
    assert (code, body) == (200, b"ok\n")


@pytest.mark.parametrize("age_s", [None, 11.0])
def test_a_camera_whose_frames_are_not_tracked_does_not_deliver(age_s):
    with page_over({"gate": MadeUp(frame_age_s=age_s)}) as url:
        assert get(url + "healthz")[0] == 503


def test_metrics_are_what_prometheus_reads(url):
    code, headers, body = get(url + "metrics")
    assert (code, headers["Content-Type"]) == (200, "text/plain; version=0.0.4; charset=utf-8")
    families = {family.name: family for family in text_string_to_metric_families(body.decode())}
    assert all(family.documentation and family.type in ("counter", "gauge") for family in families.values())
    samples = [sample for family in families.values() for sample in family.samples]
    found = {(sample.name, *sorted(sample.labels.items())): sample.value for sample in samples}
    assert len(found) == len(samples)  # none is there twice
    ups = {sample.labels["camera"]: sample.value for sample in families["vidtrack_up"].samples}
    assert ups == {"gate": 1.0, "yard": 0.0, "roof": 0.0}
    gate = ("camera", "gate")
    assert found["vidtrack_frames_dropped_total", gate] == 120
    assert found["vidtrack_reconnects_total", gate] == 2
    assert found["vidtrack_restarts_total", gate] == 3
    assert found["vidtrack_stalls_total", gate] == 1
    assert found["vidtrack_latency_seconds", gate, ("quantile", "0.99")] == 0.0885
    assert found["vidtrack_lost_total", gate, ("output", "rerun")] == 7
    assert found["vidtrack_crossings_total", gate, ("direction", "up"), ("line", 'in "A"\\')] == 3
    assert found["vidtrack_tracks", gate] == 2


def test_tracks_are_a_stream_of_json(url):
    with urllib.request.urlopen(url + "tracks", timeout=HANG_S) as stream:
        assert stream.headers["Content-Type"].startswith("application/x-ndjson")
        lines = [json.loads(stream.readline()) for _ in range(12)]
    assert {line["camera"] for line in lines} == {"gate", "yard"}
    frames = [line["frame"] for line in lines if line["camera"] == "gate"]
    assert frames == sorted(set(frames))
    assert lines[0]["time_s"] == lines[0]["frame"] / 25
    assert lines[0]["tracks"][0]["box_px"] == [290.0, 165.0, 41.0, 30.5]


def test_a_frame_is_sent_once():
    cameras = {"gate": MadeUp(frame=3), "yard": MadeUp()}
    with page_over(cameras) as url, urllib.request.urlopen(url + "tracks", timeout=HANG_S) as stream:
        lines = [json.loads(stream.readline()) for _ in range(6)]
    assert [line["camera"] for line in lines] == ["gate"] + 5 * ["yard"]


@pytest.mark.parametrize("path", ["", "status", "picture/0.jpg", "tracks", "metrics", "healthz", "static/page.js", "x"])
def test_nothing_without_the_token(path):
    with page_over({"gate": MadeUp()}, token="sesame") as url:
        for wrong in ({}, {"bearer": "sesam"}, {"password": "sesamee"}, {"bearer": ""}, {"bearer": "ä"}):
            code, headers, body = get(url + path, **wrong)
            assert code == 401
            assert headers["WWW-Authenticate"].startswith("Basic ")
            assert b"sesame" not in body


@pytest.mark.parametrize("nonsense", [b"Basic \xff\xfe", b"Basic !", b"Basic", b"Bearer", b"\xe4"])
def test_nonsense_is_no_token(nonsense):
    with page_over({"gate": MadeUp()}, token="sesame") as url:
        client = connect(url, b"GET /healthz HTTP/1.1\r\nHost: x\r\nAuthorization: " + nonsense + b"\r\n\r\n")
        assert client.recv(100).startswith(b"HTTP/1.1 401 ")
        client.close()


def test_foreign_pages_cannot_show_the_picture(url):
    for path in ("", "picture/0.jpg", "status"):
        headers = get(url + path)[1]
        assert headers["Cross-Origin-Resource-Policy"] == "same-origin"
        assert "frame-ancestors 'none'" in headers["Content-Security-Policy"]


def test_the_token_is_a_bearer_or_a_password():
    with page_over({"gate": MadeUp()}, token="sésame:1") as url:
        assert get(url + "healthz", password="sésame:1")[0] == 200
    with page_over({"gate": MadeUp()}, token="sesame") as url:
        assert get(url + "healthz", bearer="sesame", host="camera.example.org")[0] == 200


def test_without_a_token_only_names_of_this_machine_are_answered(url):
    """A foreign page may point its own name at 127.0.0.1, and would read what the browser gets."""
    assert get(url + "status", host="attacker.example.org")[0] == 400
    for host in ("localhost:80", "127.0.0.1", "[::1]:8080"):
        assert get(url + "status", host=host)[0] == 200


def test_a_failure_is_told_and_the_page_goes_on(caplog):
    with page_over({"gate": MadeUp(latency=float("nan"))}) as url:
        with caplog.at_level(logging.ERROR):
            assert get(url + "status")[0] == 500
        assert "the page failed at /status" in caplog.text
        assert get(url + "healthz")[0] == 200


def test_results_that_are_not_written_are_no_health():
    full = MadeUp(failing={"results": "No space left on device"})
    with page_over({"gate": full}) as url:
        code, _, body = get(url + "healthz")
        assert (code, body) == (503, b"gate: results: No space left on device\n")
        assert get_json(url + "status")[0]["up"] is False
