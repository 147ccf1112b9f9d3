"""Two radars that see the same aircraft, of which the second measures with a bias; as files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from vidtrack.amplitude.densities import Weibull
from vidtrack.arrays.types import Floats, Mask
from vidtrack.simulate.radar import Radar, Seen, Target, observe
from vidtrack.simulate.radar_scenarios import SURVEILLANCE, anywhere
from vidtrack.simulate.radar_write import write_plots, write_truth

SCANS = 60
NORTH = replace(SURVEILLANCE, clutter=Weibull(), place=(0.0, 15e3, 0.0))
SOUTH = replace(NORTH, place=(0.0, -15e3, 0.0), start_s=1.7)
RADARS = {"north": NORTH, "south": SOUTH}
"""Track while scan in Rayleigh clutter, 30 km apart, with the same scan time but not at the same times."""

LEAST_APART_M = 1500.0


@dataclass(frozen=True, slots=True)
class NetworkSeen:
    """What each radar of a network saw, with its bias in it, and the truth.

    seen    by name
    times   (K,) stated times of the scans of all radars, in order
    states  (targets, K, 6) x, y, z, vx, vy, vz at these times
    there   (targets, K) whether a target is in the coverage of a radar
    """

    seen: dict[str, Seen]
    times: Floats
    states: Floats
    there: Mask


def simulate_network(
    seed: int = 0, *, bias: tuple[float, float, float] = (0.0, 1.0, 0.0), targets: int = 2
) -> NetworkSeen:
    """What the two radars see of aircraft that stay 1.5 km apart and in the coverage of both; the first one turns.

    bias  what the second radar measures too much in range [m], azimuth [degrees] and time [s]
    """
    drawn, seen = observed(np.random.default_rng(seed), RADARS, targets, SCANS)
    seen["south"] = biased(seen["south"], *bias)
    return joined(drawn, seen)


def observed(
    rng: np.random.Generator, radars: Mapping[str, Radar], targets: int, scans: int
) -> tuple[list[Target], dict[str, Seen]]:
    """Aircraft that stay 1.5 km apart and in the coverage of all radars, of which the first turns; what these see."""
    while True:
        drawn = [Target(anywhere(rng, turning=k == 0)) for k in range(targets)]
        seen = {name: observe(radar, drawn, scans, rng) for name, radar in radars.items()}
        if all(one.there.all() and _apart(one.states[..., :2]) for one in seen.values()):
            return drawn, seen


def joined(drawn: Sequence[Target], seen: dict[str, Seen]) -> NetworkSeen:
    """What the radars saw of the aircraft, with the truth at the stated times of all scans."""
    times = np.sort(np.concatenate([one.times for one in seen.values()]))
    states = np.stack([np.hstack(target.flight(times)) for target in drawn])
    there = np.stack([np.any([one.radar.covers(xyz) for one in seen.values()], axis=0) for xyz in states[..., :3]])
    return NetworkSeen(seen, times, states, there)


def write_network(network: NetworkSeen, folder: Path) -> None:
    """Write a table of plots for each radar, radars.toml and truth.csv into a folder that exists."""
    for name, one in network.seen.items():
        write_plots(folder / f"{name}.csv", one)
    tables = (_table(name, one.radar) for name, one in network.seen.items())
    (folder / "radars.toml").write_text("\n".join(tables), encoding="utf-8")
    write_truth(folder / "truth.csv", network.times, network.states, network.there)


def _table(name: str, radar: Radar) -> str:
    """The radar's table in radars.toml, which does not know of a bias."""
    keys = {
        "x_m": radar.place[0],
        "y_m": radar.place[1],
        "sigma_range_m": radar.sigma[0],
        "sigma_azimuth_deg": radar.sigma[1],
        "scan_s": radar.scan_s,
        "farthest_m": radar.high[0],
    }
    return "\n".join([f"[radars.{name}]", *(f"{key} = {value}" for key, value in keys.items()), ""])


def biased(seen: Seen, range_m: float, azimuth_deg: float, time_s: float) -> Seen:
    """What a radar saw, with these biases in its plots."""
    z = seen.z + np.array([range_m, azimuth_deg])
    z[:, 1] %= 360
    return replace(seen, z=z, time_s=seen.time_s + time_s, times=seen.times + time_s)


def _apart(xy: Floats) -> bool:
    """No two of the aircraft (targets, K, 2) come near each other."""
    distance = np.linalg.norm(xy[:, None] - xy[None], axis=-1)
    return bool(distance[np.triu_indices(len(xy), 1)].min(initial=np.inf) > LEAST_APART_M)
