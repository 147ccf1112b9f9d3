"""A site's file keeps what the page does not know, whatever is changed in it."""

import tomllib
from concurrent.futures import ThreadPoolExecutor

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from vidtrack.errors import ConfigError
from vidtrack.serve.site.file import ChangedError, SiteFile, _merged, _plain
from vidtrack.traffic.site import Site, read_site

names = st.from_regex(r"[a-z0-9][a-z0-9 ._-]{0,8}[a-z0-9]", fullmatch=True)
points = st.tuples(*[st.integers(0, 4000).map(lambda tenth: tenth / 10)] * 2).map(list)
gates = st.builds(
    lambda x, y, more: {"line": [[x, y], [x + 50.5, y + 20]], **more},
    st.integers(0, 300),
    st.integers(0, 300),
    st.fixed_dictionaries({}, optional={"leg": names, "role": st.sampled_from(["entry", "exit", "both", "neutral"])}),
)
zones = points.map(lambda point: {"polygon": [point, [500, 0], [600, 470]]})
sites = st.fixed_dictionaries(
    {"site": st.fixed_dictionaries({"name": names, "width": st.just(640), "height": st.just(480)})},
    optional={
        "gates": st.dictionaries(names, gates, min_size=1, max_size=3),
        "zones": st.dictionaries(
            names, points.map(lambda p: {"polygon": [p, [500, 0], [600, 470]]}), min_size=1, max_size=2
        ),
        "classes": st.dictionaries(names, st.just([1.0, 2.5]), min_size=1, max_size=2),
        "report": st.just({"interval_s": 300}),
    },
)
times = st.sampled_from([{}, {"start": "2026-06-01T07:00:00+02:00"}, {"start": "2026-06-01T05:00:00+00:00"}])


@settings(max_examples=40)
@given(sites, times, sites, times)
def test_any_site_becomes_any_other(one, first, other, second):
    one["site"] |= first
    other["site"] |= second
    text = _merged("", one)
    assert _plain(tomllib.loads(text)) == one
    assert _merged(text, one) == text
    commented = "# who drew it\n" + text.replace("[site]", "[site] # a")
    merged = _merged(commented, other)
    assert _plain(tomllib.loads(merged)) == other
    assert merged.startswith("# who drew it\n")
    assert "[site] # a\n" in merged


HEAD = '[site]\nname = "x"\nwidth = 9\nheight = 9\n'


@pytest.mark.parametrize(
    "text",
    [
        'site = {name = "x", width = 9, height = 9}\ngates = {a = {line = [[0, 0], [1, 1]]}}\n',
        f"[gates.a]\nline = [[0, 0], [1, 1]]\n{HEAD}[gates.b]\nline = [[0, 0], [1, 2]]\n",
        'site.name = "x"\nsite.width = 9\nsite.height = 9\ngates.a.line = [[0, 0], [1, 1]]\n',
        f"[gates]\na.line = [\n  [0, 0], # left\n  [1, 1],\n]\n{HEAD}",
    ],
    ids=["inline", "apart", "dotted", "over lines"],
)
def test_files_of_any_shape_can_be_changed(tmp_path, text):
    path = tmp_path / "site.toml"
    path.write_text(text)
    file = SiteFile(path)
    tree, digest = file.read()
    tree["gates"]["c"] = {"line": [[2, 2], [3, 3]], "role": "exit"}
    tree["gates"]["a"]["line"] = [[4, 4], [5, 5]]
    tree["zones"] = {"z": {"polygon": [[0, 0], [5, 0], [5, 5]]}}
    file.save(tree, digest)
    assert read_site(path).model_dump() == Site.model_validate(tree).model_dump()


def test_a_link_stays_a_link(tmp_path):
    (tmp_path / "kept").mkdir()
    path = tmp_path / "kept" / "yard.toml"
    path.write_text(HEAD)
    (tmp_path / "site.toml").symlink_to(path)
    file = SiteFile(tmp_path / "site.toml")
    tree, digest = file.read()
    tree["site"]["name"] = "y"
    file.save(tree, digest)
    assert (tmp_path / "site.toml").is_symlink()
    assert read_site(path).camera.name == "y"


@pytest.mark.parametrize("commands", [1, 16])
def test_of_many_that_save_at_once_one_does(tmp_path, commands):
    files = [SiteFile(tmp_path / "site.toml") for _ in range(commands)]  # as each `vidtrack site` has its own

    def save(name):
        try:
            files[name % commands].save({"site": {"name": f"x{name}", "width": 9, "height": 9}}, "")
        except ChangedError:
            return False
        return True

    with ThreadPoolExecutor(8) as pool:
        assert sum(pool.map(save, range(16))) == 1
    assert read_site(tmp_path / "site.toml").camera.name.startswith("x")
    assert [path.name for path in tmp_path.iterdir()] == ["site.toml"]


def test_a_file_that_is_no_site_is_refused_in_the_words_of_read_site(tmp_path):
    path = tmp_path / "site.toml"
    for text in ("[site", f"{HEAD}[gate.a]\n", "[site]\n"):
        path.write_text(text)
        with pytest.raises(ConfigError) as ours:
            SiteFile(path).read()
        with pytest.raises(ConfigError) as theirs:
            read_site(path)
        assert str(ours.value) == str(theirs.value)
