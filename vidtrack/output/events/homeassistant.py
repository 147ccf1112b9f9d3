"""The message by which Home Assistant finds a camera and its sensors (MQTT discovery of a device).

https://www.home-assistant.io/integrations/mqtt/#device-discovery-payload
"""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

from vidtrack.output.events.event import Kind

_EVENTS = {Kind.CROSSING: "Crossing", Kind.ENTRY: "Zone entry", Kind.CONFLICT: "Conflict"}


def device_message(topic: str, camera: str, counts: Mapping[str, Mapping[str, int]]) -> dict[str, Any]:
    """The camera as a device: a counter of each line and direction, its events, and whether it has a problem.

    topic   of the camera
    camera  its name, as one level of a topic
    counts  by line and direction
    """
    name = f"vidtrack-{camera}"
    parts: dict[str, dict[str, Any]] = {
        "problem": {
            "platform": "binary_sensor",
            "name": "Problem",
            "device_class": "problem",
            "state_topic": f"{topic}/status",
            "entity_category": "diagnostic",
            "value_template": "{{ value_json.problem }}",
            "json_attributes_topic": f"{topic}/status",
            "json_attributes_template": "{{ {'why': value_json.why} | tojson }}",
        }
    }
    for kind, title in _EVENTS.items():
        parts[str(kind)] = {
            "platform": "event",
            "name": title,
            "state_topic": f"{topic}/{kind}",
            "event_types": [str(kind)],
        }
    for line, ways in counts.items():
        for way in ways:
            parts[f"count-{_id(line)}-{way}"] = {
                "platform": "sensor",
                "name": f"{line} {way}",
                "state_class": "total_increasing",
                "state_topic": f"{topic}/counts",
                "value_template": f"{{{{ value_json[{json.dumps(line)}][{json.dumps(way)}] }}}}",
            }
    return {
        "device": {
            "identifiers": [name],
            "name": camera,
            "manufacturer": "vidtrack",
            "sw_version": version("vidtrack"),
        },
        "origin": {"name": "vidtrack", "sw_version": version("vidtrack")},
        "availability_topic": f"{topic}/available",
        "qos": 1,
        "components": {key: {"unique_id": f"{name}-{key}", **part} for key, part in parts.items()},
    }


def _id(name: str) -> str:
    """The name in letters, digits, _ and -; other characters become their codes, so that names stay different."""
    return re.sub(r"[^A-Za-z0-9_-]", lambda found: f"_{ord(found[0]):x}_", name)
