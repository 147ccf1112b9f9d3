"""A process that dies or hangs costs its task, and another one takes the next."""

import os
import signal
from pathlib import Path

import pytest
from places import batch_of, small_videos

from vidtrack.run.batch import child
from vidtrack.run.batch.child import Child, attempt, end_children
from vidtrack.run.batch.task import VERSION


@pytest.fixture(scope="module")
def task(tmp_path_factory):
    folder = small_videos(tmp_path_factory.mktemp("videos"))
    batch = batch_of([folder / "cam1"], tmp_path_factory.mktemp("out"))
    return batch._waiting[0].as_dict()


@pytest.fixture
def one(monkeypatch):
    monkeypatch.setattr(child, "_START_S", 0.2)
    process = Child("out")
    yield process
    process.end()


def test_a_task_is_done_on_one_core_and_the_process_stays(task):
    first = attempt(task)
    assert first["done"]["frames"] == 30
    process = child._of_thread.child.process
    status = Path(f"/proc/{process.pid}/status").read_text()
    threads = int(status.split("Threads:")[1].split()[0])
    assert threads <= 4
    process.kill()
    process.wait()
    end_children("another place")
    assert child._of_thread.child in child._alive
    end_children(task["out"])
    assert child._of_thread.child not in child._alive


def test_a_process_works_for_the_place_of_its_last_task(monkeypatch):
    class Idle:
        """Stands for a process that is alive and answers at once."""

        def __init__(self, out):
            self.out, self.process = out, self

        def poll(self):
            return None

        def do(self, told, _patience_s):
            return {"out": self.out}

    monkeypatch.setattr(child._of_thread, "child", Idle("first"), raising=False)
    told = {"version": VERSION, "patience_s": 1.0}
    assert [attempt(told | {"out": out}) for out in ("first", "second")] == [{"out": "first"}, {"out": "second"}]


def test_a_killed_process_is_named_by_its_signal(one, task):
    os.kill(one.process.pid, signal.SIGKILL)
    outcome = one.do(task, 60.0)
    assert "SIGKILL" in outcome["error"]
    assert outcome["again"]


def test_a_process_that_hangs_is_killed(one, task):
    os.kill(one.process.pid, signal.SIGSTOP)
    outcome = one.do(task, 0.2)
    assert "no frame for 0.2 s" in outcome["error"]
    assert outcome["again"]
    assert one.process.poll() == -signal.SIGKILL


def test_a_worker_of_another_version_does_nothing(task):
    outcome = attempt(task | {"version": "0.0.1"})
    assert "the batch 0.0.1; install the same version" in outcome["error"]
    assert not outcome["again"]
