"""Access control of the pages, and security headers of its responses."""

from __future__ import annotations

import base64
import hmac

from starlette.datastructures import Headers, MutableHeaders
from starlette.middleware.trustedhost import TrustedHostMiddleware
from starlette.responses import PlainTextResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send

_OWN_NAMES = ("localhost", "127.0.0.1", "::1", "[::1]")
_ASK = {"WWW-Authenticate": 'Basic realm="vidtrack", charset="UTF-8"'}
TOKEN = "X-Vidtrack-Token"
"""Header of the token of a page that writes. Browsers send it for no other site's page."""
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


def private(app: ASGIApp, token: str) -> ASGIApp:
    """The application of a page that writes, on this machine, for the browser that was given `token` with its address.

    Every request must name this machine and the page's own port in its Host header. All but the page itself and its
    static parts need the token in the header `TOKEN`. Other requests than GET and HEAD must come from the page's own
    Origin too: no other site's page can send them, even one that has learnt the token.
    """
    return _Headers(_OwnPage(app, token))


class _OwnPage:
    """Middleware that refuses requests of other sites and those without the token."""

    def __init__(self, app: ASGIApp, token: str) -> None:
        self._app = app
        self._token = token.encode()

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        refusal = self._refusal(scope)
        app = self._app if refusal is None else PlainTextResponse(refusal[1] + "\n", refusal[0])
        await app(scope, receive, send)

    def _refusal(self, scope: Scope) -> tuple[int, str] | None:
        """Status code and words for a request that is refused."""
        headers = Headers(scope=scope)
        port = scope["server"][1]
        host = headers.get("host", "")
        if host not in {f"{name}:{port}" for name in _OWN_NAMES} | (set(_OWN_NAMES) if port == 80 else set()):
            return 400, "this is not the address of the page"
        reads = scope["method"] in ("GET", "HEAD")
        if not reads and headers.get("origin") != f"http://{host}":
            return 403, "only the page itself may send this"
        if reads and (scope["path"] == "/" or scope["path"].startswith("/static/")):
            return None
        if not hmac.compare_digest(headers.get(TOKEN, "").encode("latin-1"), self._token):
            return 401, "the token is missing or wrong; open the address that vidtrack printed"
        return None


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
