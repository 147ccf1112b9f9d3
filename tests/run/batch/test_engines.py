"""The same batch on a Dask cluster."""

import pytest
from places import batch_of, do, small_videos

from vidtrack.errors import ConfigError, StoppedEarly
from vidtrack.run.batch import engines


@pytest.fixture(scope="module", autouse=True)
def _installed():
    """Not while tests are collected: it is slow to import."""
    pytest.importorskip("distributed", reason="dask[distributed] is not installed: pip install 'vidtrack[dask]'")


@pytest.fixture(scope="module")
def cluster():
    from distributed import LocalCluster

    with LocalCluster(1, threads_per_worker=1, processes=False, dashboard_address=None, protocol="tcp") as cluster:
        yield cluster.scheduler_address


def test_dask_gives_the_results_of_this_machine(tmp_path, cluster):
    videos = small_videos(tmp_path / "in") / "cam2"
    batch = batch_of([videos], tmp_path / "dask")
    with engines.engine(cluster, None) as engine:
        assert cluster in engine.shown
        batch.run(engine, lambda progress: None)
        engine.end(str(tmp_path / "dask"))
    here = batch_of([videos], tmp_path / "here")
    do(here)
    (row,), (other,) = batch.rows.values(), here.rows.values()
    assert (row.state, row.frames, row.key) == ("done", other.frames, other.key)
    for name in ("tracks.csv", "mot.txt", "tracks.png"):
        content = [(tmp_path / out / "results" / row.folder / name).read_bytes() for out in ("dask", "here")]
        assert content[0] == content[1]


def test_workers_of_another_version_are_refused(monkeypatch, cluster):
    monkeypatch.setattr(engines, "worker_version", lambda: "0.0.1")
    with pytest.raises(ConfigError, match=r"has vidtrack 0\.0\.1"), engines.engine(cluster, None):
        pass


def test_a_scheduler_that_is_gone_is_told_in_one_line(cluster):
    with engines.engine(cluster, None) as engine:
        engine.executor._client.close()
        with pytest.raises(StoppedEarly, match=f"{cluster} is gone; run the same command again"):
            engine.check()
        engine.end("out")
        assert engine.width() == 0


@pytest.mark.parametrize(
    ("where", "message"),
    [("tcp://127.0.0.1:1", "tcp://127.0.0.1:1 does not answer"), ("cluster.json", "give local, tcp://HOST:PORT")],
)
def test_a_scheduler_that_does_not_answer(monkeypatch, where, message):
    monkeypatch.setattr(engines, "_ANSWER_S", 0.3)
    with pytest.raises(ConfigError, match=message), engines.engine(where, None):
        pass
