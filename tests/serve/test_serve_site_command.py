"""`vidtrack site`: what it opens, what it refuses, and how it ends."""

import json
import signal
import socket
import sys
from pathlib import Path
from urllib.request import Request, urlopen

import cv2
import numpy as np
import pytest
from command_line import start
from drawn_runs import straight, write_run
from page_client import HANG_S
from site_desk import ask, ask_json, served

from vidtrack.cli import main
from vidtrack.cli.site import SiteOptions, desk_of
from vidtrack.serve.access import TOKEN

SITE = '[site]\nname = "yard"\nwidth = 640\nheight = 480\n'


@pytest.fixture
def run(tmp_path):
    return Path(write_run(tmp_path / "monday, =1", [straight(1, 2.0, 50, 240, 100, 5)]))


def drawing_of(run, site=None, picture=None, plan=None):
    """What the page is told, and its picture."""
    options = SiteOptions(run=run, site=site, picture=picture, plan=plan, port=0, quiet=True, verbose=0)
    with served(desk_of(options)) as url:
        content = np.frombuffer(ask(url, "scene")[1], np.uint8)
        return ask_json(url, "drawing"), cv2.imdecode(content, cv2.IMREAD_COLOR)


def test_a_run_opens_with_its_scene_and_a_new_site_beside_it(run, tmp_path):
    cv2.imwrite(str(run / "scene.jpg"), np.zeros((480, 640, 3), np.uint8))
    process = start("site", run, cwd=tmp_path)
    try:
        url, _, token = process.stdout.readline().strip().partition("#")
        with urlopen(Request(f"{url}drawing", headers={TOKEN: token}), timeout=HANG_S) as answer:
            drawing = json.load(answer)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=HANG_S)
    finally:
        process.kill()
    assert (process.returncode, "Traceback" in err) == (0, False)
    assert drawing["tree"] == {"site": {"name": "monday_ _1", "width": 640, "height": 480}}
    assert drawing["file"] == f"{run}-site.toml"
    assert drawing["scene"] == "scene.jpg"
    assert not Path(drawing["file"]).exists()  # only Save writes


def test_the_site_that_the_run_was_tracked_with_is_drawn_on(run, tmp_path):
    (tmp_path / "yard.toml").write_text(SITE)
    summary = json.loads((run / "summary.json").read_text())
    summary["settings"]["output"] = {"site": str(tmp_path / "yard.toml")}
    (run / "summary.json").write_text(json.dumps(summary))
    cv2.imwrite(str(tmp_path / "large.png"), np.zeros((960, 1280, 3), np.uint8))
    plan = tmp_path / "plan.png"
    cv2.imwrite(str(plan), np.zeros((50, 70, 3), np.uint8))
    (tmp_path / "plan.pgw").write_text("0.1\n0\n0\n-0.1\n3\n4\n")
    drawing, scene = drawing_of(run, picture=str(tmp_path / "large.png"), plan=plan)
    assert drawing["file"] == str(tmp_path / "yard.toml")
    assert drawing["tree"]["site"]["name"] == "yard"
    assert (drawing["scene"], scene.shape) == ("large.png", (960, 1280, 3))
    assert drawing["plan"] == {"name": "plan.png", "world": [0.1, 0, 0, -0.1, 3, 4]}
    (tmp_path / "yard.toml").unlink()
    cv2.imwrite(str(run / "tracks.png"), np.zeros((960, 1280, 3), np.uint8))  # an older run
    drawing, _ = drawing_of(run)
    assert (drawing["file"], drawing["scene"]) == (f"{run}-site.toml", "tracks.png")


@pytest.mark.parametrize(
    ("arguments", "site", "code", "words"),
    {
        "no run": (["nothing"], None, 3, "is not a finished run"),
        "a site with a mistake": (["RUN", "--site", "site.toml"], SITE + "[gate.x]\n", 2, "did you mean gates?"),
        "another shape": (["RUN", "--site", "site.toml"], SITE.replace("480", "640"), 2, "not the same shape"),
        "no folder": (["RUN", "--site", "none/site.toml"], None, 3, "is no folder"),
        "no plan": (["RUN", "--plan", "none.png"], None, 3, "none.png"),
        "a bad world file": (["RUN", "--plan", "plan.png"], None, 2, "no world file"),
        "a picture of another shape": (["RUN", "--picture", "plan.png"], None, 2, "not the same shape"),
        "a port that nobody has": (["RUN", "--port", "70000"], None, 2, "65535"),
        "a port in use": (["RUN", "--port", "TAKEN"], None, 2, "address already in use"),
    }.values(),
    ids=lambda value: None,
)
def test_what_cannot_be_opened_is_refused_in_one_line(run, tmp_path, monkeypatch, capfd, arguments, site, code, words):
    if site is not None:
        (tmp_path / "site.toml").write_text(site)
    cv2.imwrite(str(tmp_path / "plan.png"), np.zeros((50, 50, 3), np.uint8))
    (tmp_path / "plan.pgw").write_text("1 2 3")
    monkeypatch.chdir(tmp_path)
    before = signal.getsignal(signal.SIGTERM)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        known = {"RUN": str(run), "TAKEN": str(taken.getsockname()[1])}
        monkeypatch.setattr(sys, "argv", ["vidtrack", "site", *(known.get(one, one) for one in arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
    signal.signal(signal.SIGTERM, before)
    out, err = capfd.readouterr()
    assert (ended.value.code, words in err, "Traceback" in err, out) == (code, True, False, "")
