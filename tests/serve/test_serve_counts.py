"""The counts by interval on the page: the last day for the chart, and any day to download."""

import csv
import time

import pytest
from page_client import MadeUp, get, get_json, page_over

from vidtrack.output.intervals.book import CountBook, Passage
from vidtrack.output.intervals.day import Plan, day_folders

NAN = float("nan")


@pytest.fixture(scope="module")
def counted(tmp_path_factory):
    """A camera that counted a vehicle each minute of the last three hours, and one two days ago."""
    folder = tmp_path_factory.mktemp("counts")
    now_s = time.time()
    book = CountBook(folder, Plan({"gate": ("left", "right")}, {}, "UTC"))
    book.add(Passage(now_s - 60 * k - 1, "gate", "left", k, NAN, 10.0, 0.1, 0.1) for k in range(180))
    book.add([Passage(now_s - 2 * 86400, "gate", "right", 1, NAN, NAN, NAN, NAN)])
    book.watch(now_s - 3 * 3600, now_s)
    book.close()
    camera = MadeUp()
    camera.counts = folder
    return camera


@pytest.fixture(scope="module")
def url(counted):
    with page_over({"gate": counted, "yard": MadeUp()}) as url:
        yield url


def test_the_last_day_for_the_chart(url, counted):
    last = get_json(url + "counts/0.json")
    assert last["days"] == [day.name for day in day_folders(counted.counts)]
    rows = [row for row in last["intervals"] if row["direction"] == "left"]
    assert sum(row["count"] or 0 for row in rows) == 180
    assert all(row["end_s"] - row["begin_s"] == 900 for row in rows)
    assert {row["time_mean_speed_kmh"] for row in rows if row["count"]} == {36.0}
    assert get_json(url + "counts/0.json?every=1h")["every_s"] == 3600


def test_any_day_to_download(url, counted):
    days = day_folders(counted.counts)
    tables = [get(f"{url}counts/0/{day.name}.csv?every=5min") for day in days]
    assert {headers["Content-Type"] for _, headers, _ in tables} == {"text/csv; charset=utf-8"}
    assert f'filename="{days[0].name}-5min.csv"' in tables[0][1]["Content-Disposition"]
    for day, (_, _, body) in zip(days, tables, strict=True):
        text = body.decode()
        assert text == (day / "5min.csv").read_text()
        assert next(csv.DictReader(text.splitlines()))["gate"] == "gate"


def test_a_camera_without_lines_has_none(url):
    assert get_json(url + "counts/1.json") == {"days": [], "intervals": []}


@pytest.mark.parametrize(
    ("path", "code"),
    [
        ("counts/2.json", 404),
        ("counts/0.json?every=2min", 400),
        ("counts/0/2020-01-01.csv", 404),
        ("counts/0/..%2f..%2fetc.csv", 404),
        ("counts/0/plan.csv", 404),
        ("counts/1/2026-11-22.csv", 404),
    ],
)
def test_what_is_not_there(url, path, code):
    assert get(url + path)[0] == code


def test_a_damaged_file_is_told(url, counted):
    (day, *_) = day_folders(counted.counts)
    path = day / "crossings.csv"
    before = path.read_bytes()
    path.write_bytes(before + b"nonsense\n")
    code, _, body = get(f"{url}counts/0/{day.name}.csv")
    path.write_bytes(before)
    assert (code, b"is damaged" in body) == (500, True)


def test_what_was_counted_today_and_in_the_last_hour(url):
    last = get_json(url + "counts/0.json")
    assert last["hour"] == {"gate": {"left": 60, "right": 0}}
    assert 0 <= last["today"]["gate"]["left"] <= 180  # by the hour of the day in UTC
    assert last["until_s"] - last["since_s"] == 86400


def test_any_day_for_the_chart(url, counted):
    day = day_folders(counted.counts)[0].name
    found = get_json(f"{url}counts/0/{day}.json?every=1h")
    assert found["until_s"] - found["since_s"] == 86400
    assert sum(row["count"] or 0 for row in found["intervals"]) == 1
    assert get(f"{url}counts/0/2020-01-01.json")[0] == 404
