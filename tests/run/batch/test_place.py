"""A place deletes what a batch left there, and nothing else."""

import pytest

from vidtrack.run.batch.place import place_of


@pytest.fixture
def partial(tmp_path):
    """A file in a folder of the name that a batch uses for what is not complete."""
    folder = tmp_path / "partial"
    folder.mkdir()
    (folder / "thesis.tex").write_text("mine")
    return folder / "thesis.tex"


def test_a_folder_of_no_batch_keeps_its_files(tmp_path, partial):
    (tmp_path / "slices").mkdir()
    with place_of(str(tmp_path)).held():
        pass
    assert partial.read_text() == "mine"
    assert (tmp_path / "slices").is_dir()


def test_what_a_killed_batch_left_is_deleted(tmp_path, partial):
    (tmp_path / "index.parquet").write_bytes(b"")
    with place_of(str(tmp_path)).held():
        assert not partial.exists()


def test_what_is_in_work_is_deleted_at_the_end(tmp_path):
    place = place_of(str(tmp_path / "new"))
    with pytest.raises(KeyboardInterrupt), place.held(), place.workspace() as folder:
        (folder / "tracks.csv").write_text("")
        raise KeyboardInterrupt
    assert not (tmp_path / "new" / "partial").exists()


def test_looking_whether_an_address_can_be_written_leaves_all_as_it_is():
    pytest.importorskip("fsspec", reason="fsspec is not installed: pip install 'vidtrack[s3]'")
    place = place_of("memory://held")
    place.write("partial/thesis.tex", b"mine")
    with place.held():
        assert place.names("") == {"partial"}
    assert place.read("partial/thesis.tex") == b"mine"
