"""Sends events as webhooks: one HTTP POST of JSON each."""

from __future__ import annotations

import base64
import http.client
import json
import logging
import ssl
from collections.abc import Mapping, Sequence
from pathlib import Path

from vidtrack.output.events.address import Hook
from vidtrack.output.events.sender import Unreachable

log = logging.getLogger(__name__)

_LATER = {401, 403, 404, 405, 407, 408, 409, 423, 425, 429}
"""Answers of 400 and more that another attempt may change: the server is set up anew, or has time. So do those from
500 on; after the others the event is left out."""


class Webhook:
    """A server that takes webhooks, with one connection.

    token    sent as bearer token; None: the user and the password of the address, if it has them
    context  of TLS

    refused  number of events that the server did not want
    """

    name = "webhook"

    def __init__(self, hook: Hook, token: str | None, timeout_s: float, context: ssl.SSLContext | None) -> None:
        self.shown = hook.shown
        self.refused = 0
        self._hook = hook
        self._headers = {"Content-Type": "application/json", "User-Agent": "vidtrack", **_authorization(hook, token)}
        self._timeout_s = timeout_s
        self._context = context
        self._connection: http.client.HTTPConnection | None = None

    def open(self) -> None:
        """Prepare a connection; the first event makes it."""
        hook = self._hook
        if hook.tls:
            self._connection = http.client.HTTPSConnection(
                hook.host, hook.port, timeout=self._timeout_s, context=self._context
            )
        else:
            self._connection = http.client.HTTPConnection(hook.host, hook.port, timeout=self._timeout_s)

    def send(self, lines: Sequence[str]) -> int:
        """Post the first event."""
        assert self._connection is not None
        body = lines[0].strip().encode()
        headers = self._headers | {"Idempotency-Key": json.loads(body)["id"]}
        try:
            self._connection.request("POST", self._hook.path, body, headers)
            with self._connection.getresponse() as answer:
                answer.read()
                status = answer.status
        except TimeoutError:
            raise Unreachable(f"cannot post to {self.shown}: no answer in {self._timeout_s:g} s") from None
        except (http.client.HTTPException, OSError) as error:
            raise Unreachable(f"cannot post to {self.shown}: {_why(error)}") from None
        if 200 <= status < 300:
            return 1
        if status < 400 or status >= 500 or status in _LATER:
            raise Unreachable(f"cannot post to {self.shown}: it answers {status}")
        self.refused += 1
        log.warning("%s refuses an event (%d); it is left out", self.shown, status)
        return 1

    def tell(self) -> None:
        """Do nothing: webhooks are of events alone."""

    def close(self) -> None:
        """Close the connection."""
        if self._connection is not None:
            self._connection.close()


def tls_context(ca_file: Path | None) -> ssl.SSLContext:
    """TLS with verified names, by the certificates in a file or by those of the system. Raises OSError."""
    return ssl.create_default_context(cafile=ca_file)


def _authorization(hook: Hook, token: str | None) -> Mapping[str, str]:
    if token is not None:
        return {"Authorization": f"Bearer {token}"}
    if hook.user is None:
        return {}
    login = base64.b64encode(f"{hook.user}:{hook.password or ''}".encode()).decode()
    return {"Authorization": f"Basic {login}"}


def _why(error: Exception) -> str:
    if isinstance(error, ssl.SSLCertVerificationError):
        return f"its certificate is not trusted ({error.verify_message})"
    if isinstance(error, OSError):
        return (error.strerror or type(error).__name__).lower()
    return type(error).__name__
