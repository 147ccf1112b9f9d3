"""What is told of an event."""

import json

from vidtrack.output.events.event import Event, Kind

CROSSING = {"line": 'Tor "1"', "direction": "left", "track_id": 7, "speed_kmh": 31.23456, "length_m": float("nan")}


def test_an_event_is_one_line_of_json_with_its_time_in_utc():
    event = Event(Kind.CROSSING, "north", 1795000000.1239, CROSSING)
    line = event.as_line("pictures/a.jpg")
    assert line.count("\n") == 1
    assert json.loads(line) == {
        "id": event.id,
        "event_type": "crossing",
        "camera": "north",
        "utc": "2026-11-18T11:06:40.123Z",
        "line": 'Tor "1"',
        "direction": "left",
        "track_id": 7,
        "speed_kmh": 31.235,
        "length_m": None,
        "picture": "pictures/a.jpg",
    }


def test_the_id_belongs_to_the_event_and_to_no_other():
    event = Event(Kind.CROSSING, "north", 1795000000.1239, CROSSING)
    assert event.id == Event(Kind.CROSSING, "north", 1795000000.1239, dict(reversed(CROSSING.items()))).id
    others = [
        Event(Kind.ENTRY, "north", 1795000000.1239, CROSSING),
        Event(Kind.CROSSING, "south", 1795000000.1239, CROSSING),
        Event(Kind.CROSSING, "north", 1795000000.1249, CROSSING),
        Event(Kind.CROSSING, "north", 1795000000.1239, CROSSING | {"track_id": 8}),
    ]
    assert len({event.id, *(other.id for other in others)}) == 5
