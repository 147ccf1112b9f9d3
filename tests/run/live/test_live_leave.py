"""A process ends with its own exit code, whatever its abandoned threads do."""

import subprocess
import sys

import pytest
from cameras import HANG_S

ABANDONED = """
import threading, time
import pyarrow as pa, pyarrow.csv
from vidtrack.__main__ import main
from vidtrack.cli import cli

class Slow:
    closed = False
    def write(self, block):
        entered.set()
        time.sleep(0.002)
        return len(block)
    def flush(self):
        pass
    def close(self):
        pass

def abandoned():
    table = pa.table({"a": list(range(200_000))})
    while True:
        with pa.PythonFile(Slow(), "w") as file:
            pa.csv.write_csv(table, file, pa.csv.WriteOptions(batch_size=100))

def command(**_):
    for _ in range(4):
        threading.Thread(target=abandoned, daemon=True).start()
    entered.wait()
    print("done")
    return CODE

entered = threading.Event()
cli.main = command
main()
"""


FAILS = """
import threading
import cv2, numpy as np
from vidtrack.run.live.leave import run_and_leave

def abandoned():
    picture = np.zeros((720, 1280, 3), np.uint8)
    while True:
        cv2.imencode(".png", picture)
        entered.set()

def fails():
    for _ in range(3):
        threading.Thread(target=abandoned, daemon=True).start()
    entered.wait()
    raise AssertionError("nobody expected this")

entered = threading.Event()
run_and_leave(fails)
"""


POOL = """
from concurrent.futures import ThreadPoolExecutor
from vidtrack.run.live.leave import leave

pool = ThreadPoolExecutor()
pool.submit(print, "done").result()
leave(3)
"""


def test_a_pool_that_nobody_closed_does_not_delay_it():
    done = subprocess.run([sys.executable, "-c", POOL], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (3, "done\n", "")


def test_an_unexpected_error_beside_threads_in_compiled_code_does_not_abort_it():
    done = subprocess.run([sys.executable, "-c", FAILS], capture_output=True, text=True, timeout=HANG_S, check=False)
    assert (done.returncode, done.stderr.splitlines()[-1]) == (1, "AssertionError: nobody expected this")


@pytest.mark.parametrize("code", [0, 3])
def test_threads_that_write_in_compiled_code_do_not_abort_it(code):
    program = [sys.executable, "-c", ABANDONED.replace("CODE", str(code))]
    for _ in range(2):
        done = subprocess.run(program, capture_output=True, text=True, timeout=HANG_S, check=False)
        assert (done.returncode, done.stdout, done.stderr) == (code, "done\n", "")
