"""Small videos, and an engine that does its tasks at once in this process."""

from __future__ import annotations

from concurrent.futures import Executor, Future

from command_line import SAMPLES, first_frames

from vidtrack.run.batch.batch import Batch
from vidtrack.run.batch.engines import Engine
from vidtrack.run.batch.place import place_of
from vidtrack.run.batch.plan import Plan
from vidtrack.run.batch.sources import listed
from vidtrack.run.batch.work import work

FRAMES = 30


def small_videos(folder):
    """Two videos of one name in two folders."""
    for name, sample in (("cam1", "crossing.avi"), ("cam2", "junction.avi")):
        (folder / name).mkdir(parents=True)
        first_frames(SAMPLES / sample, folder / name / "08-00.avi", FRAMES)
    return folder


class AtOnce(Executor):
    """Calls `do` with each task as it comes."""

    def __init__(self, do=lambda told: work(told, lambda: None)):
        self.do = do
        self.tasks = []

    def submit(self, _function, told):
        """The task done."""
        self.tasks.append((told["kind"], told["name"], told["number"]))
        future = Future()
        try:
            future.set_result(self.do(told))
        except Exception as error:  # an executor hands on whatever its task raised
            future.set_exception(error)
        return future


def engine_of(executor):
    """An engine with room for all tasks."""
    return Engine(executor, "this process", lambda: 1000, lambda out: None, lambda: None)


def batch_of(sources, out, given=(), slice_s=0.0, warm_s=None, **options):
    """A batch of these sources."""
    plan = Plan(str(out), None, tuple(given), slice_s, warm_s, 60.0)
    return Batch(place_of(str(out)), list(plan.tasks(listed([str(source) for source in sources]))), **options)


def do(batch, executor=None):
    """Do a batch; returns what was asked of the engine."""
    executor = executor or AtOnce()
    batch.run(engine_of(executor), lambda progress: None)
    return executor.tasks
