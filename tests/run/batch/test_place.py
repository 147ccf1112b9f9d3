"""A place deletes what a batch left there, and nothing else."""

from errno import ENOSPC

import pytest

from vidtrack.errors import FormatError, SourceError
from vidtrack.run.batch.place import place_of
from vidtrack.run.batch.remote import local_copy
from vidtrack.run.batch.sources import listed


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
    with place.held():
        (tmp_path / "new" / "partial" / "begun").mkdir(parents=True)
    assert not (tmp_path / "new" / "partial").exists()


def test_a_copy_gives_beats_and_can_be_one_file(tmp_path):
    pytest.importorskip("fsspec", reason="fsspec is not installed: pip install 'vidtrack[s3]'")
    (tmp_path / "00000.npz").write_bytes(b"steps")
    (tmp_path / "state.npz").write_bytes(b"state")
    place, beats = place_of("memory://copied"), []
    place.put(tmp_path, "slices/0", last="state.npz", beat=lambda: beats.append("up"))
    assert beats.count("up") >= 2
    with place.local("slices/0", lambda: beats.append("down"), only="state.npz") as folder:
        assert {path.name: path.read_bytes() for path in folder.iterdir()} == {"state.npz": b"state"}
    assert beats.count("down") == 1
    with place.local("slices/0") as folder:
        assert {path.name for path in folder.iterdir()} == {"00000.npz", "state.npz"}
    (tmp_path / "00000.npz").unlink()
    place.put(tmp_path, "slices/0", last="state.npz", beat=lambda: None)
    assert place.names("slices/0") == {"state.npz"}


def test_a_bad_table_in_a_store_is_a_fault_of_the_table():
    fsspec = pytest.importorskip("fsspec", reason="fsspec is not installed: pip install 'vidtrack[s3]'")
    fsspec.filesystem("memory").pipe_file("/tables/list.parquet", b"no table")
    with pytest.raises(FormatError, match=r"cannot read the table memory://tables/list\.parquet"):
        listed(["memory://tables/list.parquet"])
    with pytest.raises(SourceError, match="no such file"):
        listed(["memory://tables/none.parquet"])


def test_a_full_disk_is_not_a_fault_of_the_store(monkeypatch):
    fsspec = pytest.importorskip("fsspec", reason="fsspec is not installed: pip install 'vidtrack[s3]'")
    fsspec.filesystem("memory").pipe_file("/videos/a.mp4", b"video")

    def full():
        raise OSError(ENOSPC, "No space left on device")

    with pytest.raises(OSError, match=r"^\[Errno \d+\] No space left"), local_copy("memory://videos/a.mp4", full):
        pass


def test_looking_whether_an_address_can_be_written_leaves_all_as_it_is():
    pytest.importorskip("fsspec", reason="fsspec is not installed: pip install 'vidtrack[s3]'")
    place = place_of("memory://held")
    place.write("partial/thesis.tex", b"mine")
    with place.held():
        assert place.names("") == {"partial"}
    assert place.read("partial/thesis.tex") == b"mine"
