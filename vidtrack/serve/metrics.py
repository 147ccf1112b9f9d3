"""Metrics of all cameras in the Prometheus text format 0.0.4."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping

from vidtrack.serve.camera import Status

CONTENT_TYPE = "text/plain; version=0.0.4; charset=utf-8"

Sample = tuple[Mapping[str, str], float]
"""Labels in addition to the camera's, and a value."""

_QUANTILES = {"p50": "0.5", "p95": "0.95", "p99": "0.99", "max": "1"}


def metrics(cameras: Iterable[tuple[str, Status, bool]]) -> str:
    """The metrics of cameras, each given as name, status, and whether it delivers. Unknown values are left out."""
    cameras = list(cameras)
    lines = [
        "# HELP vidtrack_up Whether the camera delivers, its frames are tracked and the results written.",
        "# TYPE vidtrack_up gauge",
    ]
    lines += [_line("vidtrack_up", {"camera": name}, up) for name, _, up in cameras]
    for name, (kind, meaning, samples) in _METRICS.items():
        found = [(camera, *sample) for camera, status, _ in cameras for sample in samples(status)]
        if found:
            lines += [f"# HELP vidtrack_{name} {meaning}", f"# TYPE vidtrack_{name} {kind}"]
            lines += [_line(f"vidtrack_{name}", {"camera": camera, **labels}, value) for camera, labels, value in found]
    return "\n".join(lines) + "\n"


def _line(name: str, labels: Mapping[str, str], value: float) -> str:
    shown = ",".join(f'{label}="{_escaped(text)}"' for label, text in labels.items())
    return f"{name}{{{shown}}} {float(value)!r}"


def _escaped(text: str) -> str:
    return text.replace("\\", r"\\").replace('"', r"\"").replace("\n", r"\n")


def _field(name: str) -> Callable[[Status], Iterator[Sample]]:
    """The number of that name in the status."""

    def samples(status: Status) -> Iterator[Sample]:
        if status.get(name) is not None:
            yield {}, status[name]

    return samples


def _reading(name: str) -> Callable[[Status], Iterator[Sample]]:
    """The number of that name in the source's own account."""
    field = _field(name)
    return lambda status: field(status.get("reading", {}))


def _tracks(status: Status) -> Iterator[Sample]:
    if "tracks" in status:
        yield {}, len(status["tracks"])


def _latency(status: Status) -> Iterator[Sample]:
    for name, milliseconds in status.get("reading", {}).get("latency_ms", {}).items():
        yield {"quantile": _QUANTILES[name]}, milliseconds / 1000


def _lost(status: Status) -> Iterator[Sample]:
    for output, frames in status.get("reading", {}).get("lost", {}).items():
        yield {"output": output}, frames


def _events(name: str) -> Callable[[Status], Iterator[Sample]]:
    """A number of the events for each receiver."""

    def samples(status: Status) -> Iterator[Sample]:
        for receiver, numbers in status.get("reading", {}).get("events", {}).items():
            yield {"receiver": receiver}, numbers[name]

    return samples


def _crossings(status: Status) -> Iterator[Sample]:
    for line, ways in status.get("counts", {}).items():
        for direction, count in ways.items():
            yield {"line": line, "direction": direction}, count


_METRICS: dict[str, tuple[str, str, Callable[[Status], Iterator[Sample]]]] = {
    "frames_received_total": ("counter", "Pictures that came.", _reading("frames_received")),
    "frames_tracked_total": ("counter", "Pictures that were given to the tracker.", _reading("frames_read")),
    "frames_dropped_total": ("counter", "Pictures dropped for newer ones.", _reading("frames_dropped")),
    "decode_errors_total": ("counter", "Pictures that could not be decoded.", _reading("decode_errors")),
    "reconnects_total": ("counter", "Connections made after the first.", _reading("reconnects")),
    "restarts_total": ("counter", "Processes started in place of one that crashed.", _field("restarts")),
    "stalls_total": ("counter", "Times that the camera was connected and nothing came.", _reading("stalls")),
    "lost_total": ("counter", "Frames, packets, states not written and events not sent, by output.", _lost),
    "events_sent_total": ("counter", "Events that a receiver has taken.", _events("sent")),
    "events_waiting": ("gauge", "Events that wait for a receiver.", _events("waiting")),
    "crossings_total": ("counter", "Tracks counted over a line, by direction.", _crossings),
    "input_frames_per_second": ("gauge", "Pictures that come, lately.", _reading("fps_in")),
    "tracked_frames_per_second": ("gauge", "Pictures tracked, lately.", _field("fps_out")),
    "frame_age_seconds": ("gauge", "Time since the last frame was tracked.", _field("frame_age_s")),
    "latency_seconds": ("gauge", "From capture to tracks, quantiles of the last frames.", _latency),
    "tracks": ("gauge", "Confirmed tracks in the last frame.", _tracks),
    "start_time_seconds": ("gauge", "Unix time at which the run started.", _field("started_unix_s")),
}
