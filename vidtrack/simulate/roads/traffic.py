"""Vehicles on the routes of a network: they follow, stop at lines, give way and change lanes."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass, field

import numpy as np
from numpy.random import Generator

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.simulate.roads.driving import Drivers, idm, worth_changing
from vidtrack.simulate.roads.history import CHANGE_S, History, moved
from vidtrack.simulate.roads.network import Network
from vidtrack.simulate.roads.vehicles import LONG_M, Fleet, fleet

STEP_S = 0.1
STANDING_GAP_M = 2.0
AT_LINE_M = 0.7  # gap that is left to a stop line
CALM_BRAKING = 2.0  # m/s^2; before a stop line
MARGIN_S = 1.0  # between a vehicle that crosses and the next
MERGE_MARGIN_S = 2.0
WAITING_SPEED = 2.0  # m/s; slower vehicles at a stop line wait
THINK_STEPS = 10  # between two thoughts of changing lanes
REST_S = 3.0  # between two changes of lanes


@dataclass(eq=False)
class _Active:
    """The vehicles on the road, arrays (N,); `old` is the lane that a change leaves, or -1."""

    vehicle: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    route: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    old: Ints = field(default_factory=lambda: np.empty(0, np.int64))
    s: Floats = field(default_factory=lambda: np.empty(0))
    v: Floats = field(default_factory=lambda: np.empty(0))
    a: Floats = field(default_factory=lambda: np.empty(0))
    changed_s: Floats = field(default_factory=lambda: np.empty(0))
    aside: Floats = field(default_factory=lambda: np.empty(0))
    may_go: Mask = field(default_factory=lambda: np.empty(0, bool))

    def keep(self, rows: Mask) -> None:
        for name, values in vars(self).items():
            setattr(self, name, values[rows])

    def add(self, **row: float) -> None:
        for name, values in vars(self).items():
            setattr(self, name, np.append(values, np.array(row[name], values.dtype)))


def drive(network: Network, flow: float, begin_s: float, end_s: float, rng: Generator) -> tuple[History, Fleet]:
    """The traffic of `flow` vehicles/h in all, from an empty road at begin_s to end_s."""
    return _Simulation(network, flow, begin_s, end_s, rng).run()


class _Simulation:
    def __init__(self, network: Network, flow: float, begin_s: float, end_s: float, rng: Generator) -> None:
        self.net, self.begin, self.end = network, begin_s, end_s
        self.queues, count = self._arrivals(flow, rng)
        self.fleet = fleet(count, rng)
        self.choice = rng.uniform(0, 1, count)
        self.on = _Active()
        self.time = begin_s

    def _arrivals(self, flow: float, rng: Generator) -> tuple[list[deque[tuple[float, int]]], int]:
        """For each origin when which vehicle comes; times between are exponential."""
        net = self.net
        share = np.array(
            [
                sum(route.share for route, o in zip(net.routes, net.origin, strict=True) if o == origin)
                for origin in range(net.origin.max() + 1)
            ]
        )
        due: list[tuple[float, int]] = []
        for origin, part in enumerate(share / share.sum()):
            mean = 3600 / (flow * part)
            gaps = rng.exponential(mean, int((self.end - self.begin) / mean * 2 + 50))
            times = self.begin + np.cumsum(gaps)
            due += [(float(t), origin) for t in times[times < self.end]]
        queues: list[deque[tuple[float, int]]] = [deque() for _ in share]
        for vehicle, (t, origin) in enumerate(sorted(due)):
            queues[origin].append((t, vehicle))
        return queues, len(due)

    def run(self) -> tuple[History, Fleet]:
        steps, first, on = [], [0], self.on
        for k in range(int(np.ceil((self.end - self.begin) / STEP_S)) + 1):
            self.time = self.begin + k * STEP_S
            self._enter()
            self._let_go()
            self._change_lanes(k)
            on.a = self._acceleration()
            steps.append((on.vehicle, on.route, on.s, on.v, on.a, on.changed_s, on.aside))
            first.append(first[-1] + len(on.s))
            on.s, on.v = moved(on.s, on.v, on.a, STEP_S)
            on.v = np.maximum(on.v, 0)
            on.old = np.where(self.time + STEP_S - on.changed_s >= CHANGE_S, -1, on.old)
            on.keep(on.s + self._half(on.vehicle) < self.net.length[on.route])
        columns = [np.concatenate(column) for column in zip(*steps, strict=True)]
        return History(self.net, STEP_S, self.begin, np.array(first), *columns), self.fleet

    def _half(self, vehicle: Ints) -> Floats:
        return self.fleet.length[vehicle] / 2

    def _drivers(self, vehicle: Ints) -> Drivers:
        a, b, gap_s = self.fleet.drivers(vehicle)
        return Drivers(a, b, gap_s, np.full(len(vehicle), STANDING_GAP_M))

    def _wish(self, vehicle: Ints, route: Ints, s: Floats) -> Floats:
        return np.minimum(self.net.speed(route, s) * self.fleet.faster[vehicle], self.fleet.top[vehicle])

    def _gaps(self) -> Floats:
        """(N, N) m from the front of vehicle i to the nearest part of j on its way; infinite: j is not ahead."""
        on = self.on
        front = on.s + self._half(on.vehicle)
        gap = np.full((len(on.s), len(on.s)), np.inf)
        changing = on.old >= 0
        for mine in (on.route, on.old) if changing.any() else (on.route,):
            for other in (on.route, on.old) if changing.any() else (on.route,):
                i, j = np.nonzero(self.net.related[mine[:, None], other] & (mine >= 0)[:, None] & (other >= 0))
                length = self.fleet.length[on.vehicle[j]]
                points = on.s[j] + np.array([-0.5, 0.0, 0.5])[:, None] * length
                place = self.net.beside(mine[i], other[j], points)
                ahead = np.where(place > on.s[i], place, np.inf).min(axis=0)
                gap[i, j] = np.minimum(gap[i, j], ahead - front[i])
        np.fill_diagonal(gap, np.inf)
        return gap

    def _acceleration(self) -> Floats:
        """(N,) by the most restricting vehicle or stop line ahead; nobody rolls backwards."""
        on = self.on
        if len(on.s) == 0:
            return np.empty(0)
        drivers, wish = self._drivers(on.vehicle), self._wish(on.vehicle, on.route, on.s)
        wide = Drivers(*(values[:, None] for values in (drivers.a, drivers.b, drivers.T, drivers.s0)))
        followed = idm(on.v[:, None], wish[:, None], self._gaps(), on.v[:, None] - on.v[None], wide).min(axis=1)
        left = self._to_line()
        line = np.where(~on.may_go & (left < self._decides()), left, np.inf)
        at_line = Drivers(drivers.a, drivers.b, drivers.T, np.full(len(on.s), AT_LINE_M))
        a = np.minimum(followed, idm(on.v, wish, line, on.v, at_line))
        return np.maximum(a, -on.v / STEP_S)

    def _to_line(self) -> Floats:
        """(N,) m from each front to its stop line."""
        return self.net.stop[self.on.route] - self.on.s - self._half(self.on.vehicle)

    def _decides(self) -> Floats:
        """(N,) m before the line at which a driver must know whether he may go."""
        return self.on.v**2 / (2 * CALM_BRAKING) + 8

    def _enter(self) -> None:
        """Let waiting vehicles onto the road where there is room for them."""
        for origin, queue in enumerate(self.queues):
            if not queue or queue[0][0] > self.time:
                continue
            vehicle = queue[0][1]
            one = np.array([vehicle])
            length = float(self.fleet.length[vehicle])
            route = self._route(origin, vehicle, length > LONG_M)
            mine = self.net.origin[self.on.route] == origin
            mine |= (self.on.old >= 0) & (self.net.origin[self.on.old] == origin)
            rear = (self.on.s - self._half(self.on.vehicle))[mine]
            speed = float(self._wish(one, np.array([route]), np.zeros(1))[0])
            if len(rear):
                gap, ahead = rear.min() - length, float(self.on.v[mine][rear.argmin()])
                speed = min(speed, ahead + max(gap, 0) / 25)
                if gap < STANDING_GAP_M + 1.5 * speed:
                    continue
            queue.popleft()
            free = not np.isfinite(self.net.stop[route])
            self.on.add(vehicle=vehicle, route=route, old=-1, s=length / 2, v=speed, a=0.0, changed_s=-1e6, aside=0.0,
                        may_go=free)  # fmt: skip

    def _route(self, origin: int, vehicle: int, long: bool) -> int:
        routes = np.flatnonzero(self.net.origin == origin)
        share = np.array([self.net.routes[r].share * (self.net.routes[r].long or not long) for r in routes])
        share = share if share.any() else np.ones(len(routes))
        return int(routes[np.searchsorted(np.cumsum(share) / share.sum(), self.choice[vehicle], side="right")])

    def _let_go(self) -> None:
        """Give the way to vehicles that reach their stop line, the higher in rank and the nearer first."""
        on, net = self.on, self.net
        left = self._to_line()
        waiting = np.flatnonzero(~on.may_go & (left < self._decides()))
        for i in sorted(waiting, key=lambda i: (net.rank[on.route[i]], left[i])):
            before = ~on.may_go & (net.origin[on.route] == net.origin[on.route[i]]) & (on.s > on.s[i])
            red = net.routes[on.route[i]].red
            if not before.any() and not (red and red(self.time)):
                on.may_go[i] = not self._blocked(int(i))

    def _blocked(self, i: int) -> bool:
        """Whether a vehicle at its stop line must see another one pass first."""
        on, net, conflicts = self.on, self.net, self.net.conflicts
        r, half = on.route[i], self._half(on.vehicle)
        merges = conflicts.merges[r, on.route]
        there = conflicts.there[r, on.route] & (on.s - half < conflicts.ends[r, on.route])
        if not there.any():
            return False
        begins = np.nan_to_num(conflicts.begins[r, on.route])
        arrives = net.travel_s(on.route, begins) - net.travel_s(on.route, on.s + half)
        arrives /= np.maximum(self.fleet.faster[on.vehicle], 1)
        leaves = np.nan_to_num(conflicts.leaves[r, on.route]) + half[i]
        mine = np.full(len(on.s), r)
        needs = net.travel_s(mine, leaves) - net.travel_s(mine, np.full(len(on.s), on.s[i]))
        wish, a = net.speed(mine, leaves), self._drivers(on.vehicle[i : i + 1]).a[0]
        needs += np.maximum(wish - on.v[i], 0) ** 2 / (2 * a * wish)
        soon = arrives < needs + np.where(merges, MERGE_MARGIN_S, MARGIN_S)
        comes = soon & (net.rank[r] > net.rank[on.route]) & ~self._held_up()
        heeded = np.where(on.may_go, ~merges | soon, comes)
        return bool((there & heeded).any())

    def _held_up(self) -> Mask:
        """(N,) vehicles behind another one that waits at the same stop line."""
        on, origin = self.on, self.net.origin[self.on.route]
        waits = ~on.may_go & (on.v < WAITING_SPEED)
        return np.asarray((waits & (origin[:, None] == origin) & (on.s > on.s[:, None])).any(axis=1))

    def _change_lanes(self, step: int) -> None:
        """MOBIL for those whose turn it is to think of it."""
        on, net = self.on, self.net
        if not net.has_lanes:
            return
        rested = (on.old < 0) & (self.time - on.changed_s > CHANGE_S + REST_S)
        for i in np.flatnonzero(rested & ((step + on.vehicle) % THINK_STEPS == 0)):
            for to in (net.routes[on.route[i]].right, net.routes[on.route[i]].left):
                if to < 0 or (not net.routes[to].long and self.fleet.length[on.vehicle[i]] > LONG_M):
                    continue
                if self._pays(int(i), to):
                    here, there = (net.pose(np.array([lane]), on.s[i : i + 1]) for lane in (on.route[i], to))
                    to_left = np.array([-np.sin(there[1][0]), np.cos(there[1][0])])
                    on.changed_s, on.aside, on.route = on.changed_s.copy(), on.aside.copy(), on.route.copy()
                    on.aside[i] = (here[0][0] - there[0][0]) @ to_left
                    on.changed_s[i], on.old[i], on.route[i] = self.time, on.route[i], to
                    break

    def _pays(self, i: int, to: int) -> bool:
        on = self.on
        now, then = self._around(i, int(on.route[i])), self._around(i, to)
        if then[0] is not None and self._free_gap(then[0], i) < STANDING_GAP_M:
            return False
        if then[1] is not None and self._free_gap(i, then[1]) < STANDING_GAP_M:
            return False
        own = self._behind(i, now[1]), self._behind(i, then[1])
        new = (0.0, 0.0) if then[0] is None else (self._behind(then[0], then[1]), self._behind(then[0], i))
        old = (0.0, 0.0) if now[0] is None else (self._behind(now[0], i), self._behind(now[0], now[1]))
        return worth_changing(own, new, old, to == self.net.routes[on.route[i]].right)

    def _around(self, i: int, lane: int) -> tuple[int | None, int | None]:
        """The next vehicle behind and the next ahead in a lane."""
        on = self.on
        there = (on.route == lane) | (on.old == lane)
        there[i] = False
        behind, ahead = np.flatnonzero(there & (on.s <= on.s[i])), np.flatnonzero(there & (on.s > on.s[i]))
        follower = int(behind[on.s[behind].argmax()]) if len(behind) else None
        return follower, int(ahead[on.s[ahead].argmin()]) if len(ahead) else None

    def _free_gap(self, i: int, leader: int) -> float:
        half = self._half(self.on.vehicle)
        return float(self.on.s[leader] - self.on.s[i] - half[leader] - half[i])

    def _behind(self, i: int, leader: int | None) -> float:
        """Acceleration of i behind a leader; None: a free road."""
        on, one = self.on, slice(i, i + 1)
        gap = np.inf if leader is None else self._free_gap(i, leader)
        closing = 0.0 if leader is None else on.v[i] - on.v[leader]
        wish = self._wish(on.vehicle[one], on.route[one], on.s[one])
        return float(idm(on.v[one], wish, np.array([gap]), np.array([closing]), self._drivers(on.vehicle[one]))[0])
