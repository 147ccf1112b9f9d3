"""A page that writes answers its own browser only."""

from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest
from page_client import HANG_S
from starlette.applications import Starlette
from starlette.responses import PlainTextResponse
from starlette.routing import Route

from vidtrack.serve.access import TOKEN, private
from vidtrack.serve.listener import listen, url_of
from vidtrack.serve.server import Server


@pytest.fixture(scope="module")
def url():
    listener = listen("0", None)
    server = Server(listener)
    answer = [Route(path, lambda request: PlainTextResponse("done"), methods=["GET", "POST"]) for path in ("/", "/x")]
    server.start(private(Starlette(routes=answer), "sesame"))
    yield url_of(listener)
    server.close()


def ask(url, path="x", method="POST", **headers):
    """Status code of the answer to a request with these headers; _ stands for -."""
    headers = {name.replace("_", "-"): value for name, value in headers.items()}
    try:
        with urlopen(Request(url + path, method=method, headers=headers), timeout=HANG_S) as answer:
            return answer.status
    except HTTPError as error:
        return error.code


def test_the_page_itself_may_read_and_write(url):
    own = {TOKEN.replace("-", "_"): "sesame"}
    assert ask(url, Origin=url.rstrip("/"), **own) == 200
    assert ask(url, method="GET", **own) == 200
    assert ask(url, path="", method="GET") == 200


@pytest.mark.parametrize(
    "origin", [None, "null", "http://attacker.example.org", "http://127.0.0.1", "http://localhost:1"]
)
def test_another_site_may_not_write_even_with_the_token(url, origin):
    given = {} if origin is None else {"Origin": origin}
    assert ask(url, X_Vidtrack_Token="sesame", **given) == 403


@pytest.mark.parametrize("token", [None, "", "sesam", "sesamee", "sésame"])
def test_nothing_without_the_token(url, token):
    given = {} if token is None else {"X_Vidtrack_Token": token}
    assert ask(url, Origin=url.rstrip("/"), **given) == 401
    assert ask(url, method="GET", **given) == 401


def test_another_name_of_this_machine_is_no_address_of_the_page(url):
    port = url.rstrip("/").rpartition(":")[2]
    for host in ("attacker.example.org", f"attacker.example.org:{port}", "127.0.0.1", "127.0.0.1:1"):
        assert ask(url, path="", method="GET", Host=host) == 400
        assert ask(url, Origin=f"http://{host}", Host=host, X_Vidtrack_Token="sesame") == 400
    assert ask(url, path="", method="GET", Host=f"localhost:{port}") == 200
