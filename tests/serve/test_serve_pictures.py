"""The pictures of events: at the path that the event has, and nothing else of the disk."""

import pytest
from page_client import MadeUp, get, get_json, page_over

from vidtrack.output.events.event import Event, Kind
from vidtrack.recording.event_pictures import EventPictures
from vidtrack.recording.reserve import Reserve
from vidtrack.recording.retention import Limits

NOON = 1792800000.0


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """The folder of a camera, and the paths of its pictures, as its events have them."""
    from synthetic_steps import make_step

    folder = tmp_path_factory.mktemp("camera")
    pictures = EventPictures(folder, None, None, 75, Limits(), Reserve(0.0))
    pictures.step(make_step(3, [(7, "c", 50, 50)], shape=(100, 200)))
    events = [Event(Kind.CROSSING, "north", NOON + 40000 * k, {"track_id": k}) for k in range(30)]
    (folder / "secret.jpg").write_bytes(b"x")
    return folder, [pictures.write(event, 0.0) for event in events]


@pytest.fixture(scope="module")
def url(told):
    north = MadeUp()
    north.counts = told[0] / "intervals"
    with page_over({"north": north, "south": MadeUp()}) as url:
        yield url


def test_a_picture_is_where_its_event_says_and_the_newest_are_listed(url, told):
    folder, paths = told
    assert get_json(f"{url}camera/north/pictures.json") == paths[:5:-1]
    code, headers, content = get(f"{url}camera/north/{paths[-1]}")
    assert (code, headers["Content-Type"]) == (200, "image/jpeg")
    assert content == (folder / paths[-1]).read_bytes()
    assert get_json(f"{url}camera/south/pictures.json") == []


@pytest.mark.parametrize(
    "path",
    [
        "camera/east/pictures.json",
        "camera/south/{path}",
        "camera/north/pictures/2026-01-01/2026-01-01T00-00-00.000-0123456789abcdef01234567.jpg",
        "camera/north/pictures/..%2F/secret.jpg",
        "camera/north/pictures/../secret.jpg",
        "camera/north/pictures/2026-10-24/..%2F..%2Fsecret.jpg",
    ],
)
def test_there_is_nothing_else(url, told, path):
    assert get(url + path.format(path=told[1][-1]))[0] == 404
