"""Sends events by MQTT 3.1.1, each at least once (quality of service 1).

vidtrack/north/crossing   an event as JSON; also entry, conflict and problem
vidtrack/north/counts     retained: all crossings, by line and direction
vidtrack/north/status     retained: whether there is a problem, and which
vidtrack/north/available  retained: online, or offline, which the broker itself writes if the connection is lost
"""

from __future__ import annotations

import json
import re
import secrets
import ssl
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from threading import Event as Flag
from time import monotonic
from typing import TYPE_CHECKING

from vidtrack.errors import ConfigError
from vidtrack.output.events.address import Broker
from vidtrack.output.events.homeassistant import device_message
from vidtrack.output.events.sender import Unreachable

if TYPE_CHECKING:
    from paho.mqtt.client import Client, MQTTMessageInfo
    from paho.mqtt.reasoncodes import ReasonCode

_QOS = 1
_KEEPALIVE_S = 30
_GOODBYE_S = 0.5


@dataclass(frozen=True, slots=True)
class State:
    """What is to be known of a camera at any time.

    problem  why it does not deliver; None if it does
    counts   all crossings by line and direction; None before they are known
    """

    problem: str | None
    counts: Mapping[str, Mapping[str, int]] | None


class Mqtt:
    """A broker, for the events of one camera.

    state      returns the camera's state, which is published when it changes
    discovery  first part of the topics where Home Assistant looks for devices; None: it is not told
    context    of TLS

    Raises ConfigError without the package paho-mqtt.
    """

    name = "mqtt"

    def __init__(
        self,
        broker: Broker,
        camera: str,
        state: Callable[[], State],
        discovery: str | None,
        timeout_s: float,
        context: ssl.SSLContext | None,
    ) -> None:
        try:
            import paho.mqtt.client  # noqa: F401
        except ImportError:
            raise ConfigError('--mqtt needs the package paho-mqtt: pip install "vidtrack[mqtt]"') from None
        self.shown = broker.shown
        self._broker = broker
        self._level = topic_level(camera)
        self._topic = f"{broker.prefix}/{self._level}"
        self._state = state
        self._discovery = discovery
        self._timeout_s = timeout_s
        self._context = context
        self._client: Client | None = None
        self._told: dict[str, str] = {}  # retained topics and what they hold

    def open(self) -> None:
        """Connect, and say that the camera is online."""
        from paho.mqtt.client import Client
        from paho.mqtt.enums import CallbackAPIVersion

        name = f"vidtrack-{self._level}-{secrets.token_hex(4)}"
        client = self._client = Client(CallbackAPIVersion.VERSION2, name, reconnect_on_failure=False)
        client.connect_timeout = self._timeout_s
        if self._broker.user is not None:
            client.username_pw_set(self._broker.user, self._broker.password)
        if self._broker.tls:
            client.tls_set_context(self._context)
        client.will_set(f"{self._topic}/available", "offline", _QOS, retain=True)
        answered, answers = Flag(), []

        def connected(_: Client, __: object, ___: object, code: ReasonCode, ____: object) -> None:
            answers.append(code)
            answered.set()

        client.on_connect = connected
        try:
            client.connect(self._broker.host, self._broker.port, _KEEPALIVE_S)
        except OSError as error:
            raise Unreachable(f"cannot reach {self.shown}: {_why(error)}") from None
        client.loop_start()
        if not answered.wait(self._timeout_s):
            raise Unreachable(f"cannot reach {self.shown}: no answer in {self._timeout_s:g} s")
        if answers[0].is_failure:
            raise Unreachable(f"{self.shown} refuses the connection: {str(answers[0]).lower()}")
        self._told = {}
        self._keep(f"{self._topic}/available", "online")

    def send(self, lines: Sequence[str]) -> int:
        """Publish the events, and wait until the broker has them."""
        published = []
        for line in lines:
            kind = json.loads(line)["event_type"]
            published.append(self._publish(f"{self._topic}/{kind}", line.strip()))
        self._await(published)
        return len(lines)

    def tell(self) -> None:
        """Publish the state of the camera, and what Home Assistant needs to show it, where they have changed."""
        state = self._state()
        status = {"problem": "OFF" if state.problem is None else "ON", "why": state.problem}
        self._keep(f"{self._topic}/status", json.dumps(status, ensure_ascii=False))
        if state.counts is None:
            return
        self._keep(f"{self._topic}/counts", json.dumps(state.counts, ensure_ascii=False))
        if self._discovery is not None:
            message = device_message(self._topic, self._level, state.counts)
            self._keep(f"{self._discovery}/device/vidtrack-{self._level}/config", json.dumps(message))

    def close(self) -> None:
        """Say that the camera is offline, and disconnect."""
        client, self._client = self._client, None
        if client is None:
            return
        if client.is_connected():
            goodbye = client.publish(f"{self._topic}/available", "offline", _QOS, retain=True)
            with suppress(RuntimeError):
                goodbye.wait_for_publish(_GOODBYE_S)
        client.disconnect()
        client.loop_stop()

    def _keep(self, topic: str, text: str) -> None:
        """Publish a retained message, unless the broker has it."""
        if self._told.get(topic) != text:
            self._await([self._publish(topic, text, retain=True)])
            self._told[topic] = text

    def _publish(self, topic: str, text: str, *, retain: bool = False) -> MQTTMessageInfo:
        assert self._client is not None
        return self._client.publish(topic, text, _QOS, retain=retain)

    def _await(self, published: Sequence[MQTTMessageInfo]) -> None:
        """Wait until the broker has confirmed all of them."""
        assert self._client is not None
        until_s = monotonic() + self._timeout_s
        try:
            for message in published:
                while not message.is_published():
                    if not self._client.is_connected():
                        raise Unreachable(f"the connection to {self.shown} is lost")
                    if monotonic() > until_s:
                        raise Unreachable(f"{self.shown} does not confirm events within {self._timeout_s:g} s")
                    message.wait_for_publish(0.2)
        except RuntimeError:  # it was not even given to the connection
            raise Unreachable(f"the connection to {self.shown} is lost") from None


def topic_level(name: str) -> str:
    """The name as one level of a topic, and as an id of Home Assistant: letters, digits, _ and -."""
    return re.sub(r"[^A-Za-z0-9_-]+", "_", name).strip("_") or "camera"


def _why(error: OSError) -> str:
    if isinstance(error, ssl.SSLCertVerificationError):
        return f"its certificate is not trusted ({error.verify_message})"
    if isinstance(error, TimeoutError):
        return "no answer"
    return (error.strerror or type(error).__name__).lower()
