"""Radar plots from a table: checked, in order of scan and time."""

from __future__ import annotations

import difflib
import logging
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from vidtrack.arrays.types import Floats, Ints
from vidtrack.config.radar import RadarSettings
from vidtrack.errors import PlotFormatError
from vidtrack.radar.checks import (
    AMPLITUDE,
    CARTESIAN,
    DOPPLER,
    KNOWN,
    POLAR,
    TIME,
    check_numbers,
    check_order,
)
from vidtrack.radar.coordinates import wrap
from vidtrack.radar.numbering import numbered
from vidtrack.radar.plane import Plane
from vidtrack.radar.rhythm import scan_times
from vidtrack.radar.table import Table, bare, names_sensors, nearest, read_table

_log = logging.getLogger(__name__)

LATEST_COPY_S = 30.0
"""s; longest delay of a copy that is looked for."""
MOSTLY = 0.5
"""Share of what may be copies; with more of them at one delay, they are of one radar."""
FEW = 0.1
"""Share of the plots; with fewer that come again a table is not called one of two feeds."""
FEWEST = 10
"""Plots that come again, and scans with others, from which a second feed is told."""
OFTEN = 0.25
"""Share of the steps between them that are no longer than a scan: in others nothing new was seen."""


@dataclass(frozen=True, slots=True)
class Plots:
    """All plots of a file, sorted by scan, then time.

    scan       (N,) number of the scan; missing numbers are empty scans
    time_s     (N,) time of each plot
    z          (N, m) range [m], azimuth [rad][, elevation [rad]] or x, y[, z] [m]; then the range rate [m/s], if any
    sigma      (N, m) standard deviations of z, in its units
    polar, dim, doppler   kind of z: polar or Cartesian, two or three dimensions, with or without range rate
    amplitude  (N,) or None if the file has none
    bad_rows   number of rows left out
    losses     what else was left out, counted by name
    plane      where x = y = 0 is on the earth; None: not known
    """

    scan: Ints
    time_s: Floats
    z: Floats
    sigma: Floats
    polar: bool
    dim: int
    doppler: bool
    amplitude: Floats | None
    bad_rows: int
    losses: Mapping[str, int] = field(default_factory=dict)
    plane: Plane | None = None

    def __len__(self) -> int:
        return len(self.scan)

    def rows(self, rows: slice) -> Plots:
        """The plots of these rows."""
        amplitude = None if self.amplitude is None else self.amplitude[rows]
        z, sigma = self.z[rows], self.sigma[rows]
        return replace(self, scan=self.scan[rows], time_s=self.time_s[rows], z=z, sigma=sigma, amplitude=amplitude)

    def of_extended_targets(self, extent: float) -> Plots:
        """Plots of targets whose echo comes from a place on them, with this standard deviation [m]: larger errors."""
        if extent == 0:
            return self
        arm = np.ones((len(self), self.dim))  # m by which a unit of each component moves a target
        if self.polar:
            arm[:, 1:] = self.z[:, :1]
            if self.dim == 3:
                arm[:, 1] *= np.cos(self.z[:, 2])
            arm[:, 1:] = np.maximum(arm[:, 1:], extent)
        sigma = self.sigma.copy()
        sigma[:, : self.dim] = np.hypot(sigma[:, : self.dim], extent / arm)
        return replace(self, sigma=sigma)

    def without_range_rate(self) -> Plots:
        """The plots without range rates."""
        return replace(self, z=self.z[:, : self.dim], sigma=self.sigma[:, : self.dim], doppler=False)


def read_plots(path: str | Path, settings: RadarSettings | None = None) -> Plots:
    """Read a CSV or Parquet table of plots.

    Rows may come in any order. Without a column `scan`, plots of the same time are one scan, or, if nearly each has its
    own time, those of one turn of the antenna, and if rows in order of time go back a few times, the clock was set, or
    a day ended: time goes on. Standard deviations come from columns, else from the settings.
    Raises SourceError if the file does not exist; PlotFormatError for missing columns, a file without plots, rows of
    one radar after the other, times that begin anew and may be of several radars, and bad rows. With
    settings.skip_bad_rows bad rows are left out with a warning.
    """
    settings = settings or RadarSettings()
    table = numbered(read_table(Path(path), KNOWN), settings.position[:2])
    measured = _measured(table)
    _hint_at_misspelt(table)
    _hint_at_several(table)
    sigma = {name: _sigma(table, name, settings) for name in measured}
    check_numbers(table, measured)
    check_order(table, measured)
    if table.faults and not settings.skip_bad_rows:
        raise PlotFormatError(f"{table.problem()}; correct them, or leave them out with --skip-bad-rows")
    if not table.good.any():
        raise PlotFormatError(f"{table.problem()}; no good row is left")
    if table.faults:
        _log.warning("%s; left out", table.problem())
    plots = _sorted(table, measured, sigma)
    _hint_at_copies(table, plots)
    return plots


def _sorted(table: Table, measured: list[str], sigma: dict[str, Floats]) -> Plots:
    """The valid rows, sorted by scan and time, in radians."""
    rows = np.flatnonzero(table.good)
    scan, time_s = (table.columns[name][rows] for name in TIME)
    order = np.lexsort((time_s, scan))
    rows = rows[order]
    z, sigmas = (np.column_stack([source[name][rows] for name in measured]) for source in (table.columns, sigma))
    in_degrees = [name.endswith("_deg") for name in measured]
    z[:, in_degrees], sigmas[:, in_degrees] = np.radians(z[:, in_degrees]), np.radians(sigmas[:, in_degrees])
    polar, doppler = measured[0] == POLAR[0], measured[-1] == DOPPLER
    if polar:
        z[:, 1] = wrap(z[:, 1])
    amplitude = table.columns[AMPLITUDE][rows] if AMPLITUDE in table.columns else None
    return Plots(
        scan[order].astype(np.int64), time_s[order], z, sigmas, polar, len(measured) - doppler, doppler, amplitude,
        bad_rows=len(table.faults),
    )  # fmt: skip


def _measured(table: Table) -> list[str]:
    """The measurement columns in the order of z; polar columns if the file has both kinds."""
    unknown = [name for name in table.names if name not in KNOWN] or table.names
    if not set(TIME) & set(table.names):
        time = TIME[1]
        raise PlotFormatError(
            f"{table.path} has no column {time!r}, which plots need; {nearest(time, unknown)}; 'scan' may be left out"
        )
    for name in TIME:
        if name not in table.columns:
            raise PlotFormatError(f"{table.path} has no column {name!r}; {nearest(name, unknown)}")
    for kind in (POLAR, CARTESIAN):
        if set(kind[:2]) <= table.columns.keys():
            return [name for name in (*kind, DOPPLER) if name in table.columns]
    half = [kind for kind in (POLAR, CARTESIAN) if set(kind[:2]) & table.columns.keys()] or [POLAR, CARTESIAN]
    missing = [name for kind in half for name in kind[:2] if name not in table.columns]
    raise PlotFormatError(
        f"{table.path} has no column {missing[0]!r}; {nearest(missing[0], unknown)}; a plot needs "
        f"{' and '.join(POLAR[:2])}, or {' and '.join(CARTESIAN[:2])}"
    )


def _hint_at_misspelt(table: Table) -> None:
    """Warn of a column whose name resembles that of a missing optional column."""
    absent = {bare(name): name for name in KNOWN if name not in table.names}
    for name in table.names:
        near = [] if name in KNOWN else difflib.get_close_matches(bare(name), absent, n=1, cutoff=0.9)
        if near:
            _log.warning("%s: column %r is not used; is it %r?", table.path, name, absent[near[0]])


def _hint_at_several(table: Table) -> None:
    """Warn of a column by which the plots are of several radars: they are tracked as if they were of one."""
    for name in table.names:
        if names_sensors(name):
            count = len(table.values(name))
            if count > 1:
                _log.warning(
                    "%s: column %r has %d values, but all plots are taken as of one radar; of several radars give a "
                    "table each, with --radars", table.path, name, count,
                )  # fmt: skip


def _hint_at_copies(table: Table, plots: Plots) -> None:
    """Warn of plots that come again within half a scan: a second feed would confirm a radar's false plots.

    A radar sees what stands still again after a scan or more. The time of a scan is that between scans with plots that
    did not come within LATEST_COPY_S before.
    """
    order = np.lexsort((plots.time_s, *plots.z.T))
    z, time_s = plots.z[order], plots.time_s[order]
    new = np.append(True, (z[1:] != z[:-1]).any(axis=1) | (np.diff(time_s) > LATEST_COPY_S))
    first = np.flatnonzero(new)
    last = np.append(first[1:], len(z)) - 1
    later_s = (time_s[last] - time_s[first])[last > first]
    _, member, begun_s = scan_times(plots.scan[order][first], time_s[first])
    begun = np.bincount(member)
    steps_s = np.diff(begun_s[begun >= begun.mean() / 2])
    if len(steps_s) < FEWEST or len(z) - len(first) <= max(FEWEST, FEW * len(z)):
        return
    if (later_s < np.quantile(steps_s, OFTEN) / 2).mean() > MOSTLY:
        _log.warning(
            "%s: %d of %d plots come once more, %.3g s later, as over several feeds of one radar: false plots then "
            "seem to be confirmed; give each once", table.path, len(z) - len(first), len(z), np.median(later_s),
        )  # fmt: skip


def _sigma(table: Table, name: str, settings: RadarSettings) -> Floats:
    """(N,) standard deviations of a measured column, in its unit."""
    column = f"sigma_{name}"
    if column in table.columns:
        return table.columns[column]
    setting = "sigma_position_m" if name in CARTESIAN else column
    value = getattr(settings, setting)
    if setting not in settings.model_fields_set:
        _log.warning("%s has no column %s: radar.%s = %g is assumed", table.path, column, setting, value)
    return np.full(len(table.line), float(value))
