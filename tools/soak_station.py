"""A station of four cameras with pixels, left alone while it is hurt: what it counts, and whether it grows.

    python tools/soak_station.py [--minutes 30] [--seed 0] [--every 40] [--folder DIR]

Four cameras show the junction round and round, by one clock; `vidtrack live` tracks them with --http, --record, --roll,
--state and --keep, as a user would start it. A fifth camera, of the same pictures, is tracked without faults by a run
of its own: the reference. A sixth one is too: it says how much two runs differ that nothing happens to. About every 40
s one fault of these happens: a camera hangs up and refuses for a while, or sends nothing; the process of a camera is
killed; all processes are killed, and the command is started again; no file takes another byte for a while, as on a
full disk.

Once in 10 s a line is printed: resident MB of all processes, their handles, MB on the disk, what /healthz says. At the
end their slopes over the second half, and the crossings of each camera beside those of the reference: there once, in a
time that was not watched, missed, or found where the reference has none.
"""

from __future__ import annotations

import argparse
import os
import resource
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections import Counter
from contextlib import ExitStack, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from random import Random
from threading import Thread

import av
import cv2
import numpy as np
from soak_live import slope

from vidtrack.output.intervals.day import day_folders, read_day

SAMPLE = Path(__file__).parent.parent / "samples" / "junction.avi"
NAMES, SOUND = ("north", "east", "south", "west"), ("reference", "control")
FPS, LOOK_S, NEAR_S = 8.0, 10.0, 1.5
WARM_S = 30.0
"""s after a fault in which a vehicle may be counted that the reference lacks, or twice: the scene is learnt"""
LINES = ("gate:120,0,120,180", "ramp:0,90,240,90")


class Pictures(ThreadingHTTPServer):
    """MJPEG cameras by name, all of the picture of now. `mode`: of each, "runs", "freezes" or "refuses"."""

    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Site)
        with av.open(str(SAMPLE)) as film:
            arrays = [picture.to_ndarray(format="bgr24") for picture in film.decode(video=0)]
        self.jpegs = [cv2.imencode(".jpg", array)[1].tobytes() for array in arrays]
        self.mode = dict.fromkeys((*NAMES, *SOUND), "runs")

    def handle_error(self, *_: object) -> None:
        """Whoever hangs up does."""


class Site(BaseHTTPRequestHandler):
    """Sends the picture of now, until the camera is told otherwise."""

    server: Pictures

    def do_GET(self) -> None:
        name, own = self.path.strip("/").partition(".")[0], self.server
        if own.mode[name] == "refuses":
            return
        self.send_response(200)
        self.send_header("Content-Type", "multipart/x-mixed-replace; boundary=next")
        self.end_headers()
        last = -1
        while own.mode[name] != "refuses":
            number = int(time.time() * FPS)
            if number == last or own.mode[name] == "freezes":
                time.sleep(0.01)
                continue
            last, jpeg = number, own.jpegs[number % len(own.jpegs)]
            head = f"--next\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
            self.wfile.write(head.encode() + jpeg + b"\r\n")

    def log_message(self, *_: object) -> None:
        """Say nothing."""


class Station:
    """`vidtrack live` over the four cameras in a folder; it is started again when it has been killed."""

    def __init__(self, folder: Path, url: str) -> None:
        self._folder = folder
        cameras = "".join(f'[camera.{name}]\naddress = "{url}/{name}.mjpg"\n' for name in NAMES)
        (folder / "cameras.toml").write_text(f"output.lines = {list(LINES)}\n{cameras}")
        self.starts = 0
        self.start()

    def start(self) -> None:
        places = ["--http", "0", "--record", "tape", "--state", "state", "-o", "out", "-v"]
        limits = ["--roll", "2m", "--keep", "80MB", "--set", "live.timeout_s=8", "--set", "live.replace_state=true"]
        command = [sys.executable, "-m", "vidtrack", "live", "cameras.toml", *places, *limits]
        self._log = (self._folder.parent / f"log{self.starts}").open("w")
        self.process = subprocess.Popen(command, cwd=self._folder, stdout=self._log, stderr=self._log)
        self.starts += 1

    def children(self) -> list[int]:
        """Ids of the cameras' processes."""
        task = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children")
        with suppress(OSError):
            found = [int(word) for word in task.read_text().split()]
            return [pid for pid in found if b"spawn_main" in Path(f"/proc/{pid}/cmdline").read_bytes()]
        return []

    def kill_all(self) -> None:
        for pid in [self.process.pid, *self.children()]:
            with suppress(ProcessLookupError):
                os.kill(pid, signal.SIGKILL)
        self.process.wait()

    def health(self) -> str:
        """The first line of /healthz, or why there is none."""
        log = (self._folder.parent / f"log{self.starts - 1}").read_text()
        address = next((word for word in log.split() if word.startswith("http://") and word.endswith("/")), None)
        if address is None:
            return "no page yet"
        try:
            with urllib.request.urlopen(f"{address}healthz", timeout=5) as answer:
                return answer.read().decode().split("\n")[0]
        except urllib.error.HTTPError as error:
            return error.read().decode().split("\n")[0]
        except OSError as error:
            return str(error)


def hurt(station: Station, pictures: Pictures, rng: Random, happened: Counter, until_s: float) -> None:
    """One fault, and its end."""
    kind = rng.choice(["refuses", "freezes", "kill one", "kill one", "kill all", "full disk", "full disk"])
    length_s = min(rng.uniform(2, 25), max(0.0, until_s - time.time()))
    happened[kind] += 1
    if kind in ("refuses", "freezes"):
        name = rng.choice(NAMES)
        pictures.mode[name] = kind
        time.sleep(length_s)
        pictures.mode[name] = "runs"
    elif kind == "kill one":
        if children := station.children():
            with suppress(ProcessLookupError):
                os.kill(rng.choice(children), signal.SIGKILL)
    elif kind == "kill all":
        station.kill_all()
        time.sleep(rng.uniform(0, 5))
        station.start()
    else:
        children = station.children()
        for size in (0, resource.RLIM_INFINITY):
            for pid in children:
                with suppress(ProcessLookupError):
                    resource.prlimit(pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
            time.sleep(length_s if size == 0 else 0)


def look(station: Station, folder: Path) -> tuple[float, int, float]:
    """Resident MB and handles of all processes of the station, and MB of its results."""
    resident = handles = 0.0
    for pid in [station.process.pid, *station.children()]:
        with suppress(OSError, IndexError):
            resident += int(Path(f"/proc/{pid}/status").read_text().split("VmRSS:")[1].split()[0]) / 1024
            handles += len(list(Path(f"/proc/{pid}/fd").iterdir()))
    size = 0
    for path in folder.rglob("*"):
        with suppress(OSError):
            size += path.lstat().st_size
    return resident, int(handles), size / 1e6


def crossings(counts: Path) -> tuple[list[tuple[str, str, float]], np.ndarray]:
    """(line, direction, Unix time) of all crossings, and (S, 2) what was watched."""
    found, spans = [], [np.empty((0, 2))]
    for day in map(read_day, day_folders(counts)):
        found += [(row["gate"], row["direction"], row["utc"].timestamp()) for row in day.crossings.to_pylist()]
        spans.append(day.watched)
    return found, np.concatenate(spans)


def compared(reference, camera) -> Counter:
    """Crossings of a camera beside the reference's, each matched with at most one."""
    (expected, sure), (found, watched) = reference, camera
    left, result = sorted(found, key=lambda row: row[2]), Counter(reference=0, counted=len(found))

    def inside(spans, t: float, margin: float) -> bool:
        return bool(((spans[:, 0] + margin <= t) & (t <= spans[:, 1] - margin)).any())

    for row in sorted(expected, key=lambda row: row[2]):
        result["reference"] += 1
        near = [one for one in left if one[:2] == row[:2] and abs(one[2] - row[2]) < NEAR_S]
        if near:
            left.remove(min(near, key=lambda one: abs(one[2] - row[2])))
            result["once"] += 1
        elif inside(watched, row[2], NEAR_S):
            begins = watched[:, 0]
            result[
                "missed in a warm-up" if ((row[2] - begins > 0) & (row[2] - begins < WARM_S)).any() else "missed"
            ] += 1
        else:
            result["in a stated gap"] += 1
    for *_, t in left:
        begins = watched[:, 0]
        warm = ((t - begins > -NEAR_S) & (t - begins < WARM_S)).any() or not inside(watched, t, 0.0)
        result["not in the reference, in a warm-up" if warm else "invented"] += inside(sure, t, NEAR_S)
    return result


def sound_run(address: str, folder: Path) -> subprocess.Popen:
    """A run over a camera that nothing happens to."""
    lines = [word for line in LINES for word in ("--line", line)]
    command = [sys.executable, "-m", "vidtrack", "live", address, "-o", str(folder), "--quiet", *lines]
    return subprocess.Popen([*command, "--set", "output.level=counts", "--roll", "1h"])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--every", type=float, default=40.0, metavar="SECONDS")
    parser.add_argument("--folder", type=Path, help="where the results stay; it must not exist")
    options = parser.parse_args()
    rng, happened, seen = Random(options.seed), Counter(), []
    with ExitStack() as stack:
        root = options.folder or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        folder = root / "disk"
        folder.mkdir(parents=True)
        pictures = Pictures()
        Thread(target=pictures.serve_forever, daemon=True).start()
        url = f"http://127.0.0.1:{pictures.server_address[1]}"
        sound = [sound_run(f"{url}/{name}.mjpg", root / name) for name in SOUND]
        for process in sound:
            stack.callback(process.wait)
            stack.callback(process.terminate)
        station = Station(folder, url)
        stack.callback(station.kill_all)
        began, until_s = time.time(), time.time() + 60 * options.minutes
        faults = (station, pictures, rng, happened, until_s, options.every)
        Thread(target=hurting, args=faults, daemon=True).start()
        while time.time() < until_s:
            time.sleep(LOOK_S)
            seen.append((time.time() - began, *look(station, folder)))
            print(
                "{:6.0f} s {:7.1f} MB {:4d} handles {:6.1f} MB on the disk".format(*seen[-1]),
                station.health(),
                flush=True,
            )
        station.process.terminate()
        code = station.process.wait()
        for process in sound:
            process.terminate()
            process.wait()
        late = np.array(seen[len(seen) // 2 :], float)
        whole = late[late[:, 1] > 0.9 * np.median(late[:, 1])]  # while no process is being started
        for column, name in enumerate(("MB resident", "handles", "MB on the disk"), 1):
            b, error = slope(whole[:, 0], whole[:, column])
            print(f"{name}: {3600 * b:+.1f} +- {3600 * error:.1f} per hour, at {np.median(whole[:, column]):.1f}")
        print(f"faults {dict(happened)}, starts {station.starts}, exit code {code}")
        expected = crossings(root / "reference" / "intervals")
        for name, place in [("control", root / "control"), *((name, folder / "out" / name) for name in NAMES)]:
            print(name, dict(compared(expected, crossings(place / "intervals"))))


def hurting(
    station: Station, pictures: Pictures, rng: Random, happened: Counter, until_s: float, every_s: float
) -> None:
    """Faults until shortly before the end."""
    time.sleep(60)
    while time.time() < until_s - 60:
        hurt(station, pictures, rng, happened, until_s)
        time.sleep(rng.expovariate(1 / every_s))


if __name__ == "__main__":
    main()
