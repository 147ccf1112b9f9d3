"""A site that is drawn while the camera runs: each part has one site, and no frame is lost at the border."""

import json
import os

import pytest
from live_runs import NEVER_ROLLS, play, rows, settings

from vidtrack.cli.measure import command
from vidtrack.cli.site import SiteOptions, desk_of
from vidtrack.config.load import load
from vidtrack.errors import ConfigError
from vidtrack.output.intervals.day import day_folders, read_day
from vidtrack.output.repair import read_tracks
from vidtrack.recording.retention import parts_of
from vidtrack.recording.source import recorded_settings
from vidtrack.run.files import run_file
from vidtrack.run.live.outputs import LiveExtras
from vidtrack.run.live.run import LiveRun
from vidtrack.run.live.site import FollowedSite

BARE = '[site]\nname = "yard"\nwidth = 320\nheight = 240\n'
CORNERS = [[0, 0], [319, 0], [319, 239], [0, 239]]
GATE = "[gates.middle]\nline = [[160, 0], [160, 239]]\n"


def calibrated(px_per_m):
    """From straight above, with a gate across the picture."""
    ground = [[x / px_per_m, -y / px_per_m] for x, y in CORNERS]
    return f"{BARE}[calibration]\npicture = {CORNERS}\nground = {ground}\n[classes]\ncar = [1, 40]\n{GATE}"


@pytest.fixture(autouse=True)
def at_once(monkeypatch):
    """Each look at the file counts, however fast they follow each other."""
    monkeypatch.setattr("vidtrack.run.live.site._LOOK_S", 0.0)


def put(path, text):
    """Replace a file as an editor does that leaves no half of it."""
    new = path.with_suffix(".new")
    new.write_text(text)
    os.replace(new, path)


def opened(folder):
    """The page over the folder of a run."""
    return desk_of(SiteOptions(run=folder, site=None, picture=None, plan=None, port=0, quiet=True, verbose=0))


def measure(*arguments):
    """`vidtrack measure`."""
    command.main([*map(str, arguments), "-q"], standalone_mode=False)


def frames_of(part):
    return set(read_tracks(part / "tracks.csv")["frame"].to_pylist())


def summary(part):
    return json.loads((part / "summary.json").read_text())


def test_a_site_that_the_page_saves_begins_a_part(camera, tmp_path, monkeypatch):
    """Without metres, then with them, then with a mistake, then on another scale."""
    site, folder = tmp_path / "yard.toml", tmp_path / "out"
    site.write_text(BARE)
    monkeypatch.chdir(tmp_path)
    chosen = settings(NEVER_ROLLS, "output.site=yard.toml", ("output.lines", ["gate:160,0,160,240"]))
    page = []

    def in_part(count):
        """So many parts, and rows in the last one, of which its summary knows."""

        def enough(seen):
            parts = parts_of(folder)
            tracks = parts[-1] / "tracks.csv"
            if len(parts) < count or not tracks.exists() or not summary(parts[-1])["tracks"]:
                return False
            return tracks.read_text().count("\n") > 10

        return enough

    with LiveRun(camera.url(), chosen, folder) as run:

        def story(seen):
            yield in_part(1)
            page.append(opened(folder))
            tree, digest = page[0].file.read()
            tree["calibration"] = {"picture": CORNERS, "ground": [[x / 10, -y / 10] for x, y in CORNERS]}
            tree["gates"] = {"middle": {"line": [[160, 0], [160, 239]]}}
            page[0].file.save(tree, digest)
            yield in_part(2)
            page.append(opened(folder))
            put(site, BARE.replace("320", "240"))
            yield lambda seen: any("not the same shape" in what for _, what in run._source.stats.problems)
            put(site, calibrated(20))
            yield in_part(3)

        seen = play(run, story)
    assert [desk.file.path for desk in page] == [site, site]
    assert not (tmp_path / "out-site.toml").exists()
    first, second, third = parts = parts_of(folder)
    assert [summary(part)["interrupted"] for part in parts] == [False] * 3
    assert sum(summary(part)["frames"] for part in parts) == len(seen)  # each is in one part
    assert set(summary(folder)["lost"].values()) == {0}
    for earlier, later in ((first, second), (second, third)):
        assert max(frames_of(earlier)) < min(frames_of(later))
    assert (first / "site.toml").read_text() == BARE
    assert "x_m" not in read_tracks(first / "tracks.csv").column_names
    assert (third / "site.toml").read_text() == calibrated(20) == site.read_text()
    assert sum("goes on with the site that it has" in what for _, what in run._source.stats.problems) == 1
    for part, scale in ((second, 10), (third, 20)):
        table = read_tracks(part / "tracks.csv").drop_null()
        wide = max(table["x_m"].to_pylist())
        assert 0.4 * 320 / scale < wide < 320 / scale
        measure(part, "-o", f"measures-{scale}")
    with pytest.raises(ConfigError, match=r"give --site SITE\.toml for all of them, or measure those of each"):
        measure(folder, "-o", "all")
    measure(folder, "--site", site, "-o", "all")
    assert json.loads((tmp_path / "all" / "measures.json").read_text())["metres"]
    plan = json.loads((folder / "intervals" / "plan.json").read_text())
    assert plan["classes"] == {"car": [1, 40]}  # those of the last site
    assert list(plan["gates"]) == ["gate", "middle"]  # the gate that was drawn counts from the second part on
    assert list(summary(first)["counts"]) == ["gate"]
    ((since_s, until_s),) = plan["spans"]["middle"]
    assert until_s is None
    counted = read_day(day_folders(folder / "intervals")[-1]).crossings.to_pylist()
    late = [(row["gate"], row["direction"]) for row in counted if row["utc"].timestamp() > since_s + 1]
    assert late.count(("gate", "right")) == late.count(("middle", "right")) > 0  # both are in the same place
    assert (folder / "scene.jpg").exists()


def test_what_a_look_finds(tmp_path):
    site, told = tmp_path / "yard.toml", []
    site.write_text(BARE)
    followed = FollowedSite(site, 320, 240, told.append)

    def look():
        return [followed.changed() for _ in range(4)]

    assert look() == [False] * 4
    put(site, BARE)  # the same again
    assert look() == [False] * 4
    put(site, calibrated(10))  # at the second look, so that no half of a file is read
    assert look() == [False, True, False, False]
    assert followed.used.text == calibrated(10)
    assert followed.used.road is not None
    assert told == []
    for text, words in {
        "": "site",
        BARE + "[gate.x]\n": "did you mean gates",
        BARE.replace("240", "320"): "not the same shape",
        "\udc00": "not valid TOML",
        "a = " + 100_000 * "[": "not valid TOML",
        calibrated(10).replace("[[0, 0]", "[[319, 0]"): "calibration",
    }.items():
        site.write_bytes(text.encode("utf-8", "surrogatepass"))
        assert look() == [False] * 4
        (complaint,) = told
        assert words in complaint
        assert complaint.endswith("; the run goes on with the site that it has")
        assert "\n" not in complaint
        told.clear()
    site.unlink()
    assert look() == [False] * 4
    assert told.pop().startswith(f"cannot read site {site}: No such file")
    put(site, calibrated(10))
    assert look() == [False] * 4
    assert followed.used.text == calibrated(10)
    with pytest.raises(ConfigError, match="not the same shape"):
        FollowedSite(site, 320, 200, told.append)


def test_a_mask_that_is_drawn_is_used_from_a_part_of_the_recording_on(camera, tmp_path):
    """All over the picture, so that nothing is tracked any more; every part is repeated with the masks that it had."""
    site, tape, out = tmp_path / "yard.toml", tmp_path / "tape", tmp_path / "out"
    site.write_text(BARE)
    chosen = settings(NEVER_ROLLS, "tracker.confirm_s=0.1", f"output.site={site}")
    with LiveRun(camera.url("video.ts"), chosen, out, LiveExtras(record=tape)) as run:

        def story(seen):
            yield rows(20)
            put(site, f"{BARE}[zones.all]\npolygon = {CORNERS}\ntracked = false\n")
            yield lambda seen: len(parts_of(tape)) == 2 and not any(one.tracks for one in seen[-20:])

        seen = play(run, story)
    assert run._source.stats.reconnects == 0
    lived = [row for part in parts_of(out) for row in (part / "tracks.csv").read_text().splitlines()[1:]]
    again = []
    for number, part in enumerate(parts_of(tape)):
        with run_file(str(part), load(base=recorded_settings(str(part))), tmp_path / f"again-{number}") as repeated:
            frames = sum(1 for _ in repeated)
        again += (tmp_path / f"again-{number}" / "tracks.csv").read_text().splitlines()[1:]
    assert frames < len(seen)  # the part before the mask had its own
    assert again == lived
