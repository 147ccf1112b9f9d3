"""Two runs never write into one place, and a killed one leaves nothing locked."""

import errno
import os
import subprocess
import sys

import pytest
from command_line import ENVIRONMENT
from live_runs import NEVER_ROLLS, frames, run_until, settings

from vidtrack.errors import OutputError
from vidtrack.output.lock import exclusive
from vidtrack.run.live.outputs import LiveExtras
from vidtrack.run.live.run import LiveRun

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="needs POSIX locks")


@pytest.mark.parametrize("shared", ["out", "state", "tape"])
def test_what_another_run_writes_is_left_alone(camera, tmp_path, shared):
    place = tmp_path / shared
    rolling = settings(NEVER_ROLLS)
    extras = {"out": LiveExtras(), "state": LiveExtras(state=place), "tape": LiveExtras(record=place)}[shared]
    own = [place if shared == "out" else tmp_path / name for name in ("one", "two")]
    with LiveRun(camera.url(), rolling, own[0], extras) as first:
        run_until(first, frames(2))
        passing = {"two", "state.npz.new"}  # the second run's own folder, and what the first is about to rename
        before = {path for path in tmp_path.rglob("*") if path.name not in passing}
        with pytest.raises(OutputError, match=f"{place} is in use by another run") as caught:
            LiveRun(camera.url(), rolling, own[1], extras, force=True)
        assert caught.value.exit_code == 2
        assert before <= set(tmp_path.rglob("*"))
    with LiveRun(camera.url(), rolling, own[1], extras) as second:
        run_until(second, frames(2))


def test_the_system_takes_the_lock_from_a_killed_process(tmp_path):
    code = (
        "import sys, pathlib, time\n"
        "from vidtrack.output.lock import exclusive\n"
        "with exclusive(pathlib.Path(sys.argv[1])):\n"
        "    print('locked', flush=True)\n"
        "    time.sleep(60)\n"
    )
    for place in (tmp_path, tmp_path / "cam.state"):
        holder = subprocess.Popen(
            [sys.executable, "-c", code, str(place)], stdout=subprocess.PIPE, text=True, env=ENVIRONMENT
        )
        assert holder.stdout.readline() == "locked\n"
        with pytest.raises(OutputError, match="in use"), exclusive(place):
            pass
        holder.kill()
        holder.communicate()
        with exclusive(place):
            pass


def test_a_disk_without_locks_keeps_nobody_out(tmp_path, monkeypatch):
    def unknown(*_):
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr("fcntl.flock", unknown)
    with exclusive(tmp_path), exclusive(tmp_path):
        pass


def test_a_lock_file_that_cannot_be_made_is_told(tmp_path):
    with pytest.raises(OutputError, match="choose another place"), exclusive(tmp_path / "missing" / "cam.state"):
        pass
