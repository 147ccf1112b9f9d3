"""The discovery message against what Home Assistant documents of it.

https://www.home-assistant.io/integrations/mqtt/#device-discovery-payload, and the pages of the platforms `sensor.mqtt`,
`binary_sensor.mqtt` and `event.mqtt`.
"""

import json
import re

from jinja2 import Environment

from vidtrack.output.events.homeassistant import device_message

COUNTS = {"gate": {"left": 3, "right": 0}, "Straße 'A'": {"up": 1, "down": 2}}
AVAILABILITY = {"availability_topic", "payload_available", "payload_not_available", "availability_mode"}
DEVICE = {
    *("identifiers", "connections", "manufacturer", "model", "model_id", "name", "hw_version", "serial_number"),
    *("sw_version", "via_device", "suggested_area", "configuration_url"),
}
ORIGIN = {"name", "sw_version", "support_url"}
WHOLE = {"device", "components", "origin", "state_topic", "command_topic", "qos", "encoding", *AVAILABILITY}
ENTITY = {
    *("platform", "unique_id", "name", "device_class", "entity_category", "icon", "state_topic", "value_template"),
    *("json_attributes_topic", "json_attributes_template", "qos", "enabled_by_default", *AVAILABILITY),
}
PLATFORM = {
    "sensor": {"state_class", "unit_of_measurement", "expire_after", "force_update", "suggested_display_precision"},
    "binary_sensor": {"payload_on", "payload_off", "off_delay", "expire_after", "force_update"},
    "event": {"event_types"},
}
MESSAGE = device_message("vidtrack/north", "north", COUNTS)


def rendered(template, payload):
    return Environment().from_string(template).render(value_json=payload)


def test_it_has_the_documented_keys_and_all_that_are_required():
    assert set(MESSAGE) <= WHOLE
    assert {"device", "components", "origin"} <= set(MESSAGE)
    assert set(MESSAGE["device"]) <= DEVICE
    assert MESSAGE["device"]["identifiers"]
    assert set(MESSAGE["origin"]) <= ORIGIN
    assert MESSAGE["origin"]["name"]
    assert MESSAGE["qos"] in (0, 1, 2)
    for part in MESSAGE["components"].values():
        assert {"platform", "unique_id"} <= set(part)
        assert set(part) <= ENTITY | PLATFORM[part["platform"]]
        assert part.get("state_topic")
        assert part["platform"] != "event" or part["event_types"]
        assert part.get("entity_category") in (None, "config", "diagnostic")
    sensors = [part for part in MESSAGE["components"].values() if part["platform"] == "sensor"]
    assert all(part["state_class"] in ("measurement", "total", "total_increasing") for part in sensors)


def test_ids_are_unique_and_of_the_characters_that_discovery_allows():
    ids = [part["unique_id"] for part in MESSAGE["components"].values()]
    assert len(set(ids)) == len(ids) == 1 + 3 + 4
    other = device_message("vidtrack/south", "south", COUNTS)
    assert not set(ids) & {part["unique_id"] for part in other["components"].values()}
    assert all(re.fullmatch(r"[a-zA-Z0-9_-]+", one) for one in (*ids, *MESSAGE["components"]))
    assert json.loads(json.dumps(MESSAGE)) == MESSAGE


def test_the_templates_find_the_values_in_what_is_published():
    found = {
        part["name"]: rendered(part["value_template"], COUNTS)
        for part in MESSAGE["components"].values()
        if part["platform"] == "sensor"
    }
    assert found == {"gate left": "3", "gate right": "0", "Straße 'A' up": "1", "Straße 'A' down": "2"}
    problem = MESSAGE["components"]["problem"]
    assert rendered(problem["value_template"], {"problem": "ON", "why": "x"}) == "ON"
    assert json.loads(rendered(problem["json_attributes_template"], {"problem": "ON", "why": "x"})) == {"why": "x"}
