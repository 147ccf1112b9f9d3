"""Access control of the page, and security headers of its responses."""

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
    """The application behind a token; without one, for requests whose Host header names this machine.

    The Host header is checked against DNS rebinding: a foreign site could resolve its own name to loopback.
    """
    inner = _TokenAuthentication(app, token) if token else TrustedHostMiddleware(app, [*_OWN_NAMES], www_redirect=False)
    return _Headers(inner)


class _TokenAuthentication:
    """Middleware that requires the token, as bearer token or as password of any user."""

    def __init__(self, app: ASGIApp, token: str) -> None:
        self._app = app
        self._token = token.encode()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        given = _given_token(Headers(scope=scope).get("authorization", ""))
        granted = hmac.compare_digest(given, self._token)  # takes constant time
        app = self._app if granted else PlainTextResponse("the token is missing or wrong\n", 401, _ASK)
        await app(scope, receive, send)


def _given_token(authorization: str) -> bytes:
    scheme, _, value = authorization.partition(" ")
    if scheme.lower() == "bearer":
        return value.strip().encode("latin-1")
    if scheme.lower() == "basic":
        try:
            return base64.b64decode(value, validate=True).partition(b":")[2]
        except ValueError:  # not base64 or not ASCII
            return b""
    return b""


class _Headers:
    """Middleware that adds headers to every response: no caching, no content from other sites."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_with_headers(message: Message) -> None:
            if message["type"] == "http.response.start":
                MutableHeaders(scope=message).update(_ON_EVERY_ANSWER)
            await send(message)

        await self._app(scope, receive, send_with_headers)
