"""Who may see the page, and what its answers may do in a browser."""

from __future__ import annotations

import base64
import hmac

from starlette.datastructures import Headers, MutableHeaders
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_OWN_NAMES = ("localhost", "127.0.0.1", "::1", "[::1]")
_ASK = {"WWW-Authenticate": 'Basic realm="vidtrack", charset="UTF-8"'}
_ON_EVERY_ANSWER = {
    "Cache-Control": "no-store",
    "Content-Security-Policy": "default-src 'self'; img-src 'self' data:; frame-ancestors 'none'",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Referrer-Policy": "no-referrer",
    "X-Content-Type-Options": "nosniff",
}


def protected(app: ASGIApp, token: str | None) -> ASGIApp:
    """The application behind a token, or without one for requests that name this machine.

    The name matters: a foreign page could let its own name point to the loopback address and read along.
    """
    inner = _TokenAuthentication(app, token) if token else TrustedHostMiddleware(app, [*_OWN_NAMES], www_redirect=False)
    return _Headers(inner)


class _TokenAuthentication:
    """Lets in who brings the token, as bearer or as password of any user."""

    def __init__(self, app: ASGIApp, token: str) -> None:
        self._app = app
        self._token = token.encode()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        given = _given_token(Headers(scope=scope).get("authorization", ""))
        knows = hmac.compare_digest(given, self._token)  # in constant time
        app = self._app if knows else PlainTextResponse("the token is missing or wrong\n", 401, _ASK)
        await app(scope, receive, send)


def _given_token(authorization: str) -> bytes:
    scheme, _, value = authorization.partition(" ")
    if scheme.lower() == "bearer":
        return value.strip().encode("latin-1")
    if scheme.lower() == "basic":
        try:
            return base64.b64decode(value, validate=True).partition(b":")[2]
        except ValueError:  # no base64, or not even ASCII
            return b""
    return b""


class _Headers:
    """Adds headers to every answer: nothing is stored, nothing foreign is loaded."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(_ON_EVERY_ANSWER)
            await send(message)

        await self._app(scope, receive, send_with_headers)
