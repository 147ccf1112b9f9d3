"""A site's page over a run with known tracks, and ways to ask it."""

from __future__ import annotations

import json
from contextlib import contextmanager
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

from page_client import HANG_S

from vidtrack.serve.access import TOKEN, private
from vidtrack.serve.listener import listen, url_of
from vidtrack.serve.server import Server
from vidtrack.serve.site.app import Desk
from vidtrack.serve.site.file import SiteFile
from vidtrack.traffic.measures.recount import Recount

SESAME = "sesame"


@contextmanager
def desk_over(run, site, scene=None, plan=None):
    """The address of a page over a run, without its token."""
    recount = Recount([str(run)])
    width, height = recount.size
    new = {"site": {"name": "yard", "width": width, "height": height}}
    with served(Desk(Path(run).name, recount, SiteFile(site), new, scene, plan)) as url:
        yield url


@contextmanager
def served(desk):
    """The address of a page, without its token."""
    listener = listen("0", None)
    server = Server(listener)
    server.start(private(desk.app(), SESAME))
    try:
        yield url_of(listener)
    finally:
        server.close()


def ask(url, path, body=None):
    """Status code and text of an answer to the page itself; with a body (JSON, or bytes as they are), posted."""
    headers = {TOKEN: SESAME}
    content = body if isinstance(body, bytes | None) else json.dumps(body).encode()
    if body is not None:
        headers["Origin"] = url.rstrip("/")
    try:
        with urlopen(Request(url + path, content, headers), timeout=HANG_S) as answer:
            return answer.status, answer.read()
    except HTTPError as error:
        return error.code, error.read()


def ask_json(url, path, body=None):
    """The JSON of an answer that is one."""
    code, content = ask(url, path, body)
    assert code == 200, content
    return json.loads(content)
