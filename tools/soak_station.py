"""A station of four cameras with pixels, left alone while it is hurt: what it counts, and whether it grows.

    python tools/soak_station.py [--minutes 30] [--seed 0] [--every 40] [--folder DIR] [--disk DIR] [--film DIR]

Four cameras show a simulated road from above, by one clock, in a film that does not repeat; `vidtrack live` tracks them
with --http, --record, --roll, --state and --keep, as a user would start it. A fifth camera, of the same pictures, is
tracked without faults by a run of its own: the reference. A sixth one is too: it says how much two runs differ that
nothing happens to. About every 40 s one fault of these happens: a camera hangs up and refuses for a while, or sends
nothing; the process of a camera is killed; all processes are killed, and the command is started again; the disk is full
for a while. With --disk, the root of a small file system that nothing else uses, it is really full; else no file of the
running processes takes another byte.

Once in 10 s a line is printed: resident MB of all processes, their handles, MB on the disk, what /healthz says. At the
end their slopes over the second half, and the crossings of each camera beside those of the reference. Each is that of
one vehicle of the film: there once, in a time that was not watched, in a warm-up, missed, or found where the reference
has none. Where the reference makes two tracks of one vehicle, which the film shows, and a camera does not, the camera
has not missed anything; how often is told. The exit code is 1 if a camera has missed or invented one.
"""

from __future__ import annotations

import argparse
import errno
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

NAMES, SOUND = ("north", "east", "south", "west"), ("reference", "control")
WIDTH, HEIGHT, FPS = 320, 180, 10.0
ROAD = ("--flow", "900", "--camera-height", "25", "--tilt-deg", "75")  # no vehicle hides another
LOOK_S, NEAR_S, EXTRA_S = 10.0, 2.0, 120.0
WARM_S = 30.0
"""s after a fault in which a vehicle may be counted that the reference lacks, or twice: the scene is learnt"""
LINES = (f"gate:{WIDTH // 2},0,{WIDTH // 2},{HEIGHT - 1}", f"ramp:0,{HEIGHT // 2},{WIDTH - 1},{HEIGHT // 2}")
AXES = {"gate": (0, WIDTH // 2, ("left", "right")), "ramp": (1, HEIGHT // 2, ("up", "down"))}
"""The lines as coordinate, its value on the line, and the directions in which it falls and grows"""
Crossing = tuple[int, str, str]
"""Vehicle, line, direction"""


class Film:
    """The pictures of a road in a folder of `vidtrack simulate`, and what crosses the lines in it.

    passes  (line, direction) -> time [s from the first picture] and vehicle of each crossing
    """

    def __init__(self, folder: Path) -> None:
        with av.open(str(folder / "video.avi")) as film:
            arrays = (picture.to_ndarray(format="bgr24") for picture in film.decode(video=0))
            self.jpegs = [cv2.imencode(".jpg", array)[1].tobytes() for array in arrays]
        frame, target, left, top, width, height = np.loadtxt(folder / "gt.txt", delimiter=",", usecols=range(6)).T
        centres = np.column_stack([left + 0.5 * width, top + 0.5 * height])
        self.passes: dict[tuple[str, str], list[tuple[float, int]]] = {}
        for vehicle in np.unique(target):
            own = target == vehicle
            for line, (axis, place, directions) in AXES.items():
                side = centres[own, axis] > place
                for k in np.flatnonzero(side[1:] != side[:-1]):
                    passes = self.passes.setdefault((line, directions[int(side[k + 1])]), [])
                    passes.append((frame[own][k] / FPS, int(vehicle)))

    def times(self, crossing: Crossing) -> int:
        """How often that vehicle crosses that line in that direction."""
        vehicle, *what = crossing
        return sum(v == vehicle for _, v in self.passes[*what])

    def vehicle(self, line: str, direction: str, time_s: float) -> int:
        """Which one crossed then; -1 if none did within NEAR_S."""
        away, vehicle = min(((abs(t - time_s), v) for t, v in self.passes[line, direction]), default=(np.inf, -1))
        return vehicle if away < NEAR_S else -1


def drawn(folder: Path, seconds: float) -> Path:
    """The folder with the film of a road."""
    size = ("--size", f"{WIDTH}x{HEIGHT}", "--fps", f"{FPS:g}", "--seconds", f"{seconds:g}")
    subprocess.run([sys.executable, "-m", "vidtrack", "simulate", "road", "-o", folder, *size, *ROAD], check=True)
    return folder


class Pictures(ThreadingHTTPServer):
    """MJPEG cameras by name, all of the picture of now. `mode`: of each, "runs", "freezes" or "refuses"."""

    daemon_threads = True

    def __init__(self, jpegs: list[bytes]) -> None:
        super().__init__(("127.0.0.1", 0), Site)
        self.jpegs = jpegs
        self.began = time.time()
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
            number = min(int((time.time() - own.began) * FPS), len(own.jpegs) - 1)
            if number == last or own.mode[name] == "freezes":
                time.sleep(0.01)
                continue
            last, jpeg = number, own.jpegs[number]
            head = f"--next\r\nContent-Type: image/jpeg\r\nContent-Length: {len(jpeg)}\r\n\r\n"
            self.wfile.write(head.encode() + jpeg + b"\r\n")

    def log_message(self, *_: object) -> None:
        """Say nothing."""


class Station:
    """`vidtrack live` over the four cameras in a folder; it is started again when it has been killed.

    logs  the folder of what each start says
    """

    def __init__(self, folder: Path, logs: Path, url: str) -> None:
        self._folder, self._logs = folder, logs
        cameras = "".join(f'[camera.{name}]\naddress = "{url}/{name}.mjpg"\n' for name in NAMES)
        (folder / "cameras.toml").write_text(f"output.lines = {list(LINES)}\n{cameras}")
        self.starts = 0
        self.start()

    def start(self) -> None:
        places = ["--http", "0", "--record", "tape", "--state", "state", "-o", "out", "-v"]
        limits = ["--roll", "2m", "--keep", "80MB", "--set", "live.timeout_s=8", "--set", "live.replace_state=true"]
        command = [sys.executable, "-m", "vidtrack", "live", "cameras.toml", *places, *limits]
        with (self._logs / f"log{self.starts}").open("w") as log:
            self.process = subprocess.Popen(command, cwd=self._folder, stdout=log, stderr=log)
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
        log = (self._logs / f"log{self.starts - 1}").read_text()
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


def hurt(station: Station, pictures: Pictures, disk: Path | None, rng: Random, happened: Counter) -> None:
    """One fault, and its end."""
    kind = rng.choice(["refuses", "freezes", "kill one", "kill one", "kill all", "full disk", "full disk"])
    length_s = rng.uniform(2, 25)
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
    elif disk is not None:
        fill(disk / "ballast", time.time() + length_s)
    else:
        children = station.children()
        for size in (0, resource.RLIM_INFINITY):
            for pid in children:
                with suppress(ProcessLookupError):
                    resource.prlimit(pid, resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
            time.sleep(length_s if size == 0 else 0)


def fill(ballast: Path, until_s: float) -> None:
    """Take every byte of a disk until a time."""
    block = bytes(1 << 16)
    with ballast.open("wb", buffering=0) as file:
        while time.time() < until_s:
            try:
                file.write(block)
            except OSError as error:
                if error.errno != errno.ENOSPC:
                    raise
                time.sleep(0.01)
    ballast.unlink()


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


def crossings(counts: Path, film: Film, began: float) -> tuple[list[tuple[Crossing, float]], np.ndarray]:
    """All crossings with their Unix times, and (S, 2) what was watched."""
    found, spans = [], [np.empty((0, 2))]
    for day in map(read_day, day_folders(counts)):
        for row in day.crossings.to_pylist():
            t, what = row["utc"].timestamp(), (row["gate"], row["direction"])
            found.append(((film.vehicle(*what, t - began), *what), t))
        spans.append(day.watched)
    begins, ends = np.concatenate(spans).T
    apart = begins[1:] > ends[:-1] + 0.01  # what is told every 2 s is one span
    return found, np.column_stack([begins[np.append(True, apart)], ends[np.append(apart, True)]])


def truth(film: Film, began: float) -> list[tuple[Crossing, float]]:
    """All crossings of the film."""
    return [((vehicle, *what), began + t) for what, passes in film.passes.items() for t, vehicle in passes]


def compared(reference, camera, film: Film) -> Counter:
    """How often what happened to the crossings of a camera, where the reference watched.

    A crossing that the reference counts more often than the film has it, and the camera does not, is none.
    """
    (expected, sure), (found, watched) = reference, camera

    def inside(spans: np.ndarray, t: float, margin: float) -> bool:
        return bool(((spans[:, 0] + margin <= t) & (t <= spans[:, 1] - margin)).any())

    def in_warm_up(t: float) -> bool:
        since = t - watched[:, 0]
        return bool(((since > -NEAR_S) & (since < WARM_S)).any())

    expected = [(what, t) for what, t in expected if inside(sure, t, NEAR_S)]
    lone, alone = unpaired(expected, found), unpaired(found, expected)
    result = Counter(reference=len(expected), counted=len(found), once=len(expected) - len(lone))
    paired = Counter(what for what, _ in expected) - Counter(what for what, _ in lone)
    for what, t in lone:
        if not inside(watched, t, NEAR_S):
            result["in a stated gap"] += 1
        elif 0 < film.times(what) <= paired[what]:
            result["twice in the reference alone"] += 1
        else:
            result["missed in a warm-up" if in_warm_up(t) else "missed"] += 1
            print("   missed", what, round(t, 2), "in a warm-up" if in_warm_up(t) else "")
    for what, t in alone:
        if inside(sure, t, 2 * NEAR_S):
            warm = in_warm_up(t) or not inside(watched, t, 0.0)
            result["again or alone in a warm-up" if warm else "invented"] += 1
            print("   more than the reference has", what, round(t, 2), "in a warm-up" if warm else "")
    return result


def unpaired(crossings: list[tuple[Crossing, float]], others: list[tuple[Crossing, float]]) -> list:
    """The crossings that are left when each has got at most one of the others: the same one, within NEAR_S."""
    left, times = [], {}
    for what, t in others:
        times.setdefault(what, []).append(t)
    for what, t in crossings:
        there = times.get(what, [])
        nearest = min(there, key=lambda other: abs(other - t), default=np.inf)
        if abs(nearest - t) < NEAR_S:
            there.remove(nearest)
        else:
            left.append((what, t))
    return left


def sound_run(address: str, folder: Path) -> subprocess.Popen:
    """A run over a camera that nothing happens to."""
    lines = [word for line in LINES for word in ("--line", line)]
    command = [sys.executable, "-m", "vidtrack", "live", address, "-o", str(folder), "--quiet", *lines]
    return subprocess.Popen([*command, "--set", "output.level=counts", "--roll", "1h"])


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=30.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--every", type=float, default=40.0, metavar="SECONDS")
    parser.add_argument("--folder", type=Path, help="where the results stay; it must not exist")
    parser.add_argument("--disk", type=Path, help="the root of a small file system, for the station")
    parser.add_argument("--film", type=Path, help="a film that was drawn before")
    options = parser.parse_args()
    rng, happened, seen = Random(options.seed), Counter(), []
    with ExitStack() as stack:
        root = options.folder or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        folder = (options.disk or root) / "station"
        folder.mkdir(parents=True)
        root.mkdir(parents=True, exist_ok=True)
        film = Film(options.film or drawn(root / "film", 60 * options.minutes + EXTRA_S))
        pictures = Pictures(film.jpegs)
        Thread(target=pictures.serve_forever, daemon=True).start()
        url = f"http://127.0.0.1:{pictures.server_address[1]}"
        sound = [sound_run(f"{url}/{name}.mjpg", root / name) for name in SOUND]
        for process in sound:
            stack.callback(process.wait)
            stack.callback(process.terminate)
        station = Station(folder, root, url)
        stack.callback(station.kill_all)
        until_s = pictures.began + 60 * options.minutes
        faults = (station, pictures, options.disk, rng, happened, until_s, options.every)
        Thread(target=hurting, args=faults, daemon=True).start()
        while time.time() < until_s:
            time.sleep(LOOK_S)
            seen.append((time.time() - pictures.began, *look(station, folder)))
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
        reference, control = (crossings(root / name / "intervals", film, pictures.began) for name in SOUND)
        print("reference beside the film", dict(compared((truth(film, pictures.began), reference[1]), reference, film)))
        print("control", dict(compared(reference, control, film)))
        total: Counter = Counter()
        for name in NAMES:
            camera = crossings(folder / "out" / name / "intervals", film, pictures.began)
            found = compared(reference, camera, film)
            print(name, dict(found), flush=True)
            total += found
        print("all", dict(total))
    return int(total["missed"] + total["invented"] > 0)


def hurting(
    station: Station,
    pictures: Pictures,
    disk: Path | None,
    rng: Random,
    happened: Counter,
    until_s: float,
    every_s: float,
) -> None:
    """Faults until shortly before the end."""
    time.sleep(60)
    while time.time() < until_s - 60:
        hurt(station, pictures, disk, rng, happened)
        time.sleep(rng.expovariate(1 / every_s))


if __name__ == "__main__":
    sys.exit(main())
