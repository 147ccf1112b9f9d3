"""Tracking in a picture, with boxes, border and road; and the null object for point measurements."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from vidtrack.arrays.types import Floats, Ints, Mask
from vidtrack.associate.look import Look
from vidtrack.associate.problem import Problem
from vidtrack.associate.shape import Shape
from vidtrack.errors import ConfigError
from vidtrack.estimate.bank import Estimator
from vidtrack.scan import Scan
from vidtrack.tracking.boxes import absolute, around, follow, longer
from vidtrack.tracking.picture.border import Border
from vidtrack.tracking.picture.road import Road
from vidtrack.tracking.register import Register
from vidtrack.tracks import Tracks

LOOK_S = 1.0
"""s; time constant with which the look of a track follows that of its measurement."""


class View(NamedTuple):
    """Boxes of measurements and tracks in a scan.

    blobs      (M, 4) boxes of the measurements
    relative   (M, 4) the same, relative to the measurements
    predicted  (T, 4) boxes of the tracks
    hits       (T,) updates of the tracks so far
    border     of what was surveyed
    box_s      s; time constant with which the box of a track follows that of its measurement
    looks, look  (M, 3) of the measurements and (T, 3) of the tracks, grey levels; None, NaN: not known
    """

    blobs: Floats
    relative: Floats
    predicted: Floats
    hits: Ints
    border: Border
    box_s: float
    looks: Floats | None
    look: Floats


class Surroundings(Protocol):
    """The surroundings of targets: a `Picture`, or `NoPicture`."""

    @property
    def area(self) -> float | None:
        """Surveyed area [px^2]; None: not known."""

    @property
    def road(self) -> Road | None:
        """Maps learnt from traffic; None without them."""

    def rescale(self, register: Register, before: Floats, bank: Estimator) -> None:
        """Change the sizes of boxes as their tracks move from states `before` (T, n) to those of the bank."""

    def view(self, scan: Scan, register: Register, bank: Estimator) -> View | None:
        """What the scan shows; None where measurements have no boxes."""

    def weigh(self, problem: Problem, view: View | None) -> Problem:
        """The problem with what boxes tell of each pair."""

    def follow(self, view: View | None, taken: Ints, register: Register, bank: Estimator, dt: float) -> None:
        """Move the boxes of tracks towards those of the measurements that they have taken (T,)."""

    def sides(self, box: Floats) -> Mask:
        """(N, 4) which sides (left, top, right, bottom) of boxes (N, 4) the border of what the scan surveyed cuts."""

    def relieved(self, register: Register, bank: Estimator) -> Mask:
        """(T,) tracks that have left, and in whose place others come in."""

    def in_view(self, x: Floats, P: Floats) -> Floats:
        """(N,) probability that states x (N, n), P (N, n, n) are where the scan looks; elsewhere P_D is zero."""

    def size(self, box: Floats, xy: Floats) -> Floats:
        """(T,) sizes by which objects at xy (T, d) must travel to be believed."""

    def learn(self, tracks: Tracks) -> None:
        """Take in the tracks of a scan."""


class NoPicture:
    """Measurements are points, and what is surveyed has no border."""

    STATE = ()

    @property
    def area(self) -> None:
        """Not known."""

    @property
    def road(self) -> None:
        """Nothing."""

    def rescale(self, register: Register, before: Floats, bank: Estimator) -> None:
        """Nothing has a box."""

    def view(self, scan: Scan, register: Register, bank: Estimator) -> None:
        """Nothing."""

    def weigh(self, problem: Problem, view: View | None) -> Problem:
        """The problem as it is."""
        return problem

    def follow(self, view: View | None, taken: Ints, register: Register, bank: Estimator, dt: float) -> None:
        """Nothing has a box."""

    def sides(self, box: Floats) -> Mask:
        """(N, 4) none."""
        return np.zeros((len(box), 4), bool)

    def relieved(self, register: Register, bank: Estimator) -> Mask:
        """(T,) none."""
        return np.zeros(len(register), bool)

    def in_view(self, x: Floats, P: Floats) -> Floats:
        """(N,) ones."""
        return np.ones(len(x))

    def size(self, box: Floats, xy: Floats) -> Floats:
        """(T,) zeros."""
        return np.zeros(len(box))

    def learn(self, tracks: Tracks) -> None:
        """Do nothing."""


class Picture:
    """The picture of a camera. It learns, if it has a road: each tracker needs its own.

    bounds  (width, height) px; outside P_D is zero and tracks are deleted; None: as each scan says, else no border
    shape   how the size of boxes counts in the association; None: it does not
    look    how luminance and chroma count in the association; None: they do not
    road    what traffic teaches about the scene, scan by scan; None: nothing
    box_s   time constant [s] with which a track's box follows its measurements' boxes
    relieve whether a track that comes in again over the border before it was out is another object's, and ends

    Raises ConfigError for a time constant that is not above zero.
    """

    STATE = ("road",)

    def __init__(
        self,
        bounds: tuple[float, float] | None = None,
        *,
        shape: Shape | None = None,
        look: Look | None = None,
        road: Road | None = None,
        box_s: float = 0.3,
        relieve: bool = False,
    ) -> None:
        if not box_s > 0:
            raise ConfigError(f"box_s is {box_s}; it must be above zero")
        self.area = bounds[0] * bounds[1] if bounds else None
        self.shape = shape
        self.look = look
        self.road = road
        self.box_s = box_s
        self.relieve = relieve
        self.border = Border(*bounds) if bounds else Border()

    def rescale(self, register: Register, before: Floats, bank: Estimator) -> None:
        """Far vehicles look small: boxes grow on their way from states `before` (T, n)."""
        if self.road and self.road.sizes.known:
            register.box *= self.road.growth(around(before, register.box), around(bank.x, register.box))

    def view(self, scan: Scan, register: Register, bank: Estimator) -> View | None:
        """What the scan shows within its border; None where measurements have no boxes."""
        self.border = self.border.of(scan)
        if scan.box is None:
            return None
        predicted = around(bank.x, register.box)
        boxes = absolute(scan.box, scan.z)
        return View(boxes, scan.box, predicted, bank.hits, self.border, self.box_s, scan.look, register.look)

    def weigh(self, problem: Problem, view: View | None) -> Problem:
        """The problem with the likelihood of sizes and looks; no flake is a measurement of a vehicle."""
        if view is None:
            return problem
        if self.road and (largest := self.road.flake):
            flake, vehicle = longer(view.blobs) <= largest, longer(view.predicted) > largest
            pairs = problem.pairs
            problem = problem.having(pairs.only(~(flake[pairs.measurement] & vehicle[pairs.row])))
        if self.shape is not None:
            problem = problem.having(self.shape.weigh(problem.pairs, view.predicted, view.blobs))
        if self.look is not None and view.looks is not None:
            problem = problem.having(self.look.weigh(problem.pairs, view.look, view.looks))
        return problem

    def follow(self, view: View | None, taken: Ints, register: Register, bank: Estimator, dt: float) -> None:
        """Move boxes and looks of tracks towards those they have taken (T,); a box that the border cuts is copied."""
        if view is None:
            return
        least = -float(np.expm1(-dt / self.box_s))
        follow(register.box, view.relative, taken, self.border.cut(view.blobs), least, bank.hits)
        if self.look is not None and view.looks is not None:
            least, never = -float(np.expm1(-dt / LOOK_S)), np.zeros(len(view.looks), bool)
            follow(register.look, view.looks, taken, never, least, bank.hits)
        if bank.model.per_size:
            np.copyto(bank.scale, longer(register.box), where=taken >= 0)

    def sides(self, box: Floats) -> Mask:
        """(N, 4) which sides of boxes (N, 4) the border of the last scan cuts."""
        return self.border.sides(box)

    def relieved(self, register: Register, bank: Estimator) -> Mask:
        """(T,) tracks that drove out over a side of the border, and come in over it before they were out.

        That is another vehicle, which was one blob with the one that left.
        """
        if not self.relieve:
            return np.zeros(len(register), bool)
        box = around(bank.x, register.box)
        alone = (register.history & 1 == 1) & (register.merged < 0)
        return self.border.relieved(box, bank.x.take(bank.model.velocity, axis=1), alone, register.shown)

    def in_view(self, x: Floats, P: Floats) -> Floats:
        """(N,) probability that states x (N, n), P (N, n, n) are within the border of the last scan."""
        return self.border.in_view(x, P)

    def size(self, box: Floats, xy: Floats) -> Floats:
        """(T,) longer sides, of specks that of the least object; more where the picture is restless."""
        side = longer(box)
        size = np.fmax(side, self.border.speck)  # NaN where there is no box
        return size * self.road.travel_factor(xy, side) if self.road else size

    def learn(self, tracks: Tracks) -> None:
        """Update the road with the tracks of a scan."""
        if self.road:
            self.road.learn(tracks)
