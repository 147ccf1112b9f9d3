"""What the page of a site is told, and what it may write."""

import json
import shutil
import struct
from pathlib import Path

import pytest
from drawn_runs import CALIBRATED, straight, write_run
from site_desk import ask, ask_json, desk_over, served

from vidtrack.errors import ConfigError
from vidtrack.serve.site.app import Desk, Picture
from vidtrack.serve.site.file import SiteFile
from vidtrack.serve.site.plan import read_world, world_file
from vidtrack.traffic.measures.recount import Recount
from vidtrack.traffic.site import read_site

PLACE = """# The yard behind the works.
[site]
name = "yard"  # as on the plan
width = 640
height = 480
start = 2026-06-01T07:00:00+02:00
[gates.west]
line = [[100, 0], [100, 479]]
role = "entry"
[gates.east]   # beside the fence
line = [[500, 479], [500, 0]]
role = "exit"
[classes]
car = [3.2, 5.4]   # without trailers
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    tracks = [straight(k, 2.0 + 8 * k, 50, 150 + 40 * k, 100, 5) for k in range(4)]
    return write_run(tmp_path_factory.mktemp("yard") / "run", tracks, metres=True, covariances=True)


@pytest.fixture
def desk(run, tmp_path):
    """Address of a page, and its site's file."""
    path = tmp_path / "site.toml"
    path.write_text(PLACE)
    with desk_over(run, path) as url:
        yield url, path


def test_a_gate_that_is_moved_is_saved_and_all_else_stays(desk):
    url, path = desk
    opened = ask_json(url, "drawing")
    tree = opened["tree"]
    tree["gates"]["west"]["line"][0] = [120, 0]
    tree["gates"]["new"] = {"line": [[300, 10], [300, 400]]}
    saved = ask_json(url, "save", {"tree": tree, "digest": opened["digest"], "world": None})
    text = path.read_text()
    changed = PLACE.replace("line = [[100, 0], [100, 479]]", "line = [[120, 0], [100, 479]]")
    assert [line for line in text.splitlines() if line] == [
        *changed.partition("[classes]")[0].splitlines(),
        "[gates.new]",
        "line = [[300, 10], [300, 400]]",
        *"".join(changed.partition("[classes]")[1:]).splitlines(),
    ]
    assert read_site(path).gates["new"].line == ((300, 10), (300, 400))
    assert ask_json(url, "drawing") == opened | {"tree": tree, "digest": saved["digest"]}
    assert [entry.name for entry in path.parent.iterdir()] == ["site.toml"]


def test_a_new_site_is_made_where_there_is_none(run, tmp_path):
    path = tmp_path / "site.toml"
    with desk_over(run, path) as url:
        opened = ask_json(url, "drawing")
        assert opened["tree"] == {"site": {"name": "yard", "width": 640, "height": 480}}
        tree = opened["tree"] | {"gates": {"west": {"line": [[1, 2], [3, 4]], "leg": "west", "role": "entry"}}}
        tree["site"]["start"] = "2026-06-01T07:00:00+02:00"
        tree["gates"]["west"]["role"], tree["calibration"] = "entry", None
        ask_json(url, "save", {"tree": tree, "digest": opened["digest"], "world": None})
    assert "start = 2026-06-01T07:00:00+02:00\n" in path.read_text()  # a time, not a text
    assert read_site(path).gates["west"].leg == "west"


def test_who_saves_second_is_told_and_nothing_is_lost(desk):
    url, path = desk
    mine, other = ask_json(url, "drawing"), ask_json(url, "drawing")
    other["tree"]["site"]["name"] = "theirs"
    ask_json(url, "save", {"tree": other["tree"], "digest": other["digest"], "world": None})
    theirs = path.read_text()
    code, words = ask(url, "save", {"tree": mine["tree"], "digest": mine["digest"], "world": None})
    assert (code, b"changed by somebody else" in words) == (409, True)
    assert path.read_text() == theirs
    path.unlink()
    code, words = ask(url, "save", {"tree": mine["tree"], "digest": mine["digest"], "world": None})
    assert (code, b"deleted by somebody else" in words) == (409, True)
    assert not path.exists()


def test_pages_know_of_each_other_and_of_the_file(desk):
    url, path = desk
    digest = ask_json(url, "drawing")["digest"]
    assert ask_json(url, "here", {"editor": "a", "open": True}) == {"digest": digest, "others": 0, "shown": None}
    assert ask_json(url, "here", {"editor": "b", "open": True})["others"] == 1
    assert ask_json(url, "here", {"editor": "b", "open": False})["others"] == 1
    path.write_text(PLACE + "\n")
    again = ask_json(url, "here", {"editor": "a", "open": True})
    assert (again["digest"] != digest, again["others"]) == (True, 0)


@pytest.mark.parametrize(
    ("change", "words"),
    {
        "a line that crosses itself": (
            {"gates": {"x": {"line": [[0, 0], [100, 100], [100, 0], [0, 100]]}}},
            "gates.x.line = [[0, 0], [100, 100], [100, 0], [0, 100]]: the line crosses itself",
        ),
        "a tag": ({"gates": {"<b>x</b>": {"line": [[0, 0], [9, 9]]}}}, "a name begins with a letter or a digit"),
        "a formula": ({"zones": {"=1+1": {"polygon": [[0, 0], [9, 0], [9, 9]]}}}, "a name begins with a letter"),
        "a comma": ({"zones": {"a, b": {"polygon": [[0, 0], [9, 0], [9, 9]]}}}, "a name begins with a letter"),
        "outside": ({"gates": {"x": {"line": [[0, 0], [900, 100]]}}}, "the point (900, 100) of x lies outside"),
        "an unknown key": ({"gates": {"x": {"lime": 1, "line": [[0, 0], [9, 9]]}}}, "did you mean line?"),
        "no such gate": ({"sections": {"s": {"from": "wets", "to": "east", "length_m": 9}}}, "did you mean west?"),
        "three points": (
            {"calibration": {"picture": [[0, 0], [9, 0], [9, 9]], "ground": [[0, 0], [9, 0], [9, 9]]}},
            "3 pairs of points; a plane needs at least 4",
        ),
        "points on a line": (
            {
                "calibration": {
                    "picture": [[0, 0], [9, 0], [19, 0], [9, 9]],
                    "ground": [[0, 0], [9, 0], [19, 0], [9, 9]],
                }
            },
            "lie on one line",
        ),
        "mirrored": (
            {"calibration": {"picture": [[0, 0], [9, 0], [9, 9], [0, 9]], "ground": [[0, 0], [9, 0], [9, 9], [0, 9]]}},
            "the points are mirrored",
        ),
        "no number": ({"report": {"interval_s": "much"}}, "report.interval_s = 'much'"),
        "no time": ({"site": {"name": "y", "width": 640, "height": 480, "start": "noon"}}, "write date, time and zone"),
    }.values(),
    ids=lambda value: None,
)
def test_mistakes_are_told_in_the_words_of_the_site_and_are_not_saved(desk, tmp_path, change, words):
    url, path = desk
    opened = ask_json(url, "drawing")
    tree = opened["tree"] | change
    found = ask_json(url, "look", {"tree": tree, "count": True})
    assert words in "\n".join(fault["words"] for fault in found["faults"])
    code, said = ask(url, "save", {"tree": tree, "digest": opened["digest"], "world": None})
    assert (code, words in said.decode()) == (422, True)
    assert path.read_text() == PLACE
    gates = tree["gates"] if "gates" not in change else {}
    assert set(found.get("tally", {}).get("counts", {})) >= set(gates)  # what is right is counted meanwhile


def test_counts_residuals_and_a_grid(desk):
    url, _ = desk
    tree = ask_json(url, "drawing")["tree"] | {"calibration": CALIBRATED["calibration"]}
    found = ask_json(url, "look", {"tree": tree, "count": True})
    assert found["faults"] == []
    assert found["tally"] == {
        "counts": {"west": {"left": 0, "right": 4}, "east": {"left": 0, "right": 4}},
        "stays": {},
        "movements": [["west", "east", 4]],
        "trips": 4,
    }
    calibration = found["calibration"]
    assert [pair["residual_px"] < 0.1 for pair in calibration["pairs"]] == [True] * 8
    assert calibration["grid_m"] == 5
    for line in calibration["grid"]:  # 5 m are 50 px
        assert min(len({round(x) for x, _ in line}), len({round(y) for _, y in line})) <= 2
    a, b, w = (row[0] * 320 + row[1] * 200 + row[2] for row in calibration["metres"])
    assert (a / w, b / w) == pytest.approx((32, 28), abs=0.02)
    wrong = json.loads(json.dumps(tree))
    wrong["calibration"]["picture"][4][0] += 30
    found = ask_json(url, "look", {"tree": wrong, "count": False})
    assert found["calibration"]["wrong"] == [5]
    assert "pair 5 of the calibration" in found["warnings"][0]
    assert "tally" not in found


def test_parts_that_a_running_camera_deletes_are_left_out(tmp_path):
    """Metres are read when the calibration is drawn, which may be days after the page was opened."""
    parts = [write_run(tmp_path / f"part{k}", [straight(k, 2.0, 50, 150, 100, 5)], covariances=True) for k in range(3)]
    tree = json.loads(json.dumps(CALIBRATED))
    desk = Desk("yard", Recount([str(part) for part in parts]), SiteFile(tmp_path / "site.toml"), tree, None, None)
    with served(desk) as url:
        for part, left in zip(parts, (2, 1, None), strict=True):
            shutil.rmtree(part)
            tree["calibration"]["ground"][0][0] += 0.001
            found = ask_json(url, "look", {"tree": tree, "count": True})
            if left is None:
                assert "the tracks of this run have been deleted" in "\n".join(found["warnings"])
                assert ask(url, "paths", {"tree": tree})[0] == 422
            else:
                assert found["tally"]["counts"]["middle"]["right"] == left
                assert ask(url, "paths", {"tree": tree})[0] == 200


def test_paths_are_as_many_as_tracks(desk):
    url, _ = desk
    code, content = ask(url, "paths", {"tree": ask_json(url, "drawing")["tree"]})
    assert code == 200
    (count,) = struct.unpack_from("<I", content)
    lengths = struct.unpack_from(f"<{count}I", content, 4)
    assert count == 4
    assert len(content) == 4 + 4 * count + 8 * sum(lengths)
    x, y = struct.unpack_from("<2f", content, 4 + 4 * count)
    assert (x, y) == (50, 151)  # a fifth of the box above its lower edge


@pytest.mark.parametrize(
    ("path", "body", "code"),
    [
        ("look", b"{", 400),
        ("look", b"[]", 400),
        ("look", {"tree": {}}, 400),
        ("look", {"tree": "x", "count": True}, 400),
        ("save", {"tree": {}, "digest": 3, "world": None}, 400),
        ("look", b'{"tree": {"a": "' + b"x" * 5_000_000 + b'"}}', 413),
        ("look", b"[" * 100_000, 400),
        ("look", b'{"tree": {"site": {"name": "\\ud800"}}, "count": true}', 400),
        ("scene", None, 404),
        ("plan", None, 404),
        ("static/../app.py", None, 404),
    ],
)
def test_nonsense_is_refused(desk, path, body, code):
    url, _ = desk
    assert ask(url, path, body)[0] == code
    assert ask(url, "drawing")[0] == 200


def test_a_tree_that_is_no_site_at_all_is_only_refused(desk):
    url, _ = desk
    for tree in ({}, {"site": []}, {"site": {}, "gates": 7}, {"gates": {"x": 7}, "site": {"name": 1}}, {"": {}}):
        found = ask_json(url, "look", {"tree": tree, "count": True})
        assert found["faults"]
        assert ask(url, "save", {"tree": tree, "digest": "", "world": None})[0] == 422


def test_the_page_loads_nothing_foreign(desk):
    url, _ = desk
    static = Path("vidtrack/serve/site/static")
    for path in ("", *(f"static/{file.name}" for file in static.iterdir())):
        code, body = ask(url, path)
        assert code == 200
        assert b"://" not in body.replace(b"http://www.w3.org/2000/svg", b"")


def test_the_scale_of_a_plan_is_kept_in_its_world_file(run, tmp_path):
    plan = tmp_path / "plan.png"
    plan.write_bytes(b"")
    with desk_over(run, tmp_path / "site.toml", plan=(plan, Picture("plan.png", b"", "image/png"))) as url:
        opened = ask_json(url, "drawing")
        assert opened["plan"] == {"name": "plan.png", "world": None}
        world = [0.1, 0, 0, -0.1, 5.5, 40]
        for wrong in ([1, 2], [0, 0, 0, 0, 0, 0], ["x"] * 6):
            assert ask(url, "save", {"tree": opened["tree"], "digest": "", "world": wrong})[0] == 422
        assert not world_file(plan).exists()
        ask_json(url, "save", {"tree": opened["tree"], "digest": "", "world": world})
        assert read_world(plan) == tuple(world)
        assert world_file(plan).name == "plan.pgw"
        assert ask_json(url, "drawing")["plan"]["world"] == world


@pytest.mark.parametrize("text", ["", "1 2 3", "a b c d e f", "0 0 0 0 1 1", "nan 0 0 1 0 0"])
def test_what_is_no_world_file_is_refused(tmp_path, text):
    (tmp_path / "plan.jgw").write_text(text)
    with pytest.raises(ConfigError, match="no world file"):
        read_world(tmp_path / "plan.jpg")
