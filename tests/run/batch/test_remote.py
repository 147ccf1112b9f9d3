"""Sources and results in a store of S3's kind, here moto's server on this machine."""

import pytest
from places import FRAMES, batch_of, do, small_videos

from vidtrack.errors import SourceError
from vidtrack.run.batch.archive import is_archive, portions
from vidtrack.run.batch.index import DONE
from vidtrack.run.batch.place import place_of
from vidtrack.run.batch.sources import listed


@pytest.fixture(scope="module", autouse=True)
def _installed():
    """Not while tests are collected: they are slow to import."""
    pytest.importorskip("s3fs", reason="s3fs is not installed: pip install 'vidtrack[s3]'")
    pytest.importorskip("moto.server", reason="moto[server] is not installed: pip install 'vidtrack[test]'")


@pytest.fixture(scope="module")
def bucket(tmp_path_factory):
    """The address of a bucket with a folder of two videos."""
    import fsspec
    import s3fs
    from moto.server import ThreadedMotoServer

    server = ThreadedMotoServer("127.0.0.1", port=0)
    server.start()
    host, port = server.get_host_and_port()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("AWS_ACCESS_KEY_ID", "someone")
        patch.setenv("AWS_SECRET_ACCESS_KEY", "not-to-be-seen")
        patch.setenv("AWS_ENDPOINT_URL", f"http://{host}:{port}")
        patch.setenv("AWS_DEFAULT_REGION", "us-east-1")
        s3fs.S3FileSystem.clear_instance_cache()
        store = fsspec.filesystem("s3")
        store.mkdir("city")
        store.put(str(small_videos(tmp_path_factory.mktemp("videos"))), "city/in", recursive=True)
        yield "s3://city"
    s3fs.S3FileSystem.clear_instance_cache()
    server.stop()


@pytest.fixture(scope="module")
def done(bucket):
    out = f"{bucket}/out"
    batch = batch_of([f"{bucket}/in"], out)
    do(batch)
    return out, batch


def test_folders_patterns_and_tables_by_address(bucket, tmp_path):
    videos = [f"{bucket}/in/cam1/08-00.avi", f"{bucket}/in/cam2/08-00.avi"]
    assert [source.address for source in listed([f"{bucket}/in"])] == videos
    assert [source.address for source in listed([f"{bucket}/in/*/08-00.avi"])] == videos
    (tmp_path / "list.csv").write_text(f"source\n{videos[1]}\n")
    (one,) = listed([str(tmp_path / "list.csv")])
    assert (one.address, one.size > 0, one.stamp != "") == (videos[1], True, True)
    with pytest.raises(SourceError, match="no such file"):
        listed([f"{bucket}/in/none.mp4"])


def test_results_are_there_and_are_not_done_again(bucket, done):
    out, batch = done
    assert [row.state for row in batch.rows.values()] == [DONE, DONE]
    assert {row.frames for row in batch.rows.values()} == {FRAMES}
    place = place_of(out)
    for row in batch.rows.values():
        assert {"tracks.parquet", "tracks.csv", "summary.json", "source.json"} <= place.names(f"results/{row.folder}")
        assert f'"source": "{row.source}"' in place.read(f"results/{row.folder}/summary.json").decode()
    assert do(batch_of([f"{bucket}/in"], out)) == []
    assert place.names("slices") == place.names("partial") == set()


def test_no_secret_is_written(done):
    out, batch = done
    place = place_of(out)
    for row in batch.rows.values():
        for name in place.names(f"results/{row.folder}"):
            assert b"not-to-be-seen" not in place.read(f"results/{row.folder}/{name}")


def test_a_place_at_an_address_is_an_archive(done):
    out, _ = done
    assert is_archive(out)
    with pytest.raises(SourceError, match="with a site"):
        portions(out, None)


def test_slices_go_on_from_each_other_over_a_store(bucket, tmp_path):
    video = small_videos(tmp_path) / "cam1" / "08-00.avi"
    batch = batch_of([video], f"{bucket}/sliced", slice_s=1.0)
    assert [(kind, number) for kind, _, number in do(batch)] == [("file", 0), ("slice", 0), ("slice", 1), ("stitch", 0)]
    assert [(row.state, row.frames) for row in batch.rows.values()] == [(DONE, FRAMES)]
    assert place_of(f"{bucket}/sliced").names("slices") == set()
    again = batch_of([video], f"{bucket}/sliced", again=True)
    do(again)
    assert [row.state for row in again.rows.values()] == [DONE]
