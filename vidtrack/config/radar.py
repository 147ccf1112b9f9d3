"""Settings of radar runs."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from vidtrack.config.group import Group
from vidtrack.config.names import Estimator, Life, Model, Resampling

Latitude = Annotated[float, Field(ge=-90, le=90)]
Longitude = Annotated[float, Field(ge=-180, le=180)]


class RadarSettings(Group):
    """Radar plots: metres, seconds, degrees; x east, y north, z up, azimuth clockwise from north."""

    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """m; x, y, z of the radar, the origin of range and azimuth"""
    geodetic: tuple[Latitude, Longitude, float] | None = None
    """degrees, degrees, m; latitude, longitude and height in WGS84 of x = y = z = 0; None: not known"""
    sac: int | None = Field(None, ge=0, le=255)
    """system area code of the radar to track, where ASTERIX holds several; None: the only one"""
    sic: int | None = Field(None, ge=0, le=255)
    """system identification code, likewise"""
    scan_s: float | None = Field(None, ge=0.1, le=3600)
    """s; duration of a scan of ASTERIX or NMEA; None: from the antenna's marks, azimuths or times"""
    sigma_range_m: float = Field(50.0, gt=0)
    """m; standard deviation of a range where the file has no column sigma_range_m"""
    sigma_azimuth_deg: float = Field(0.3, gt=0, le=45)
    """degrees; the same of an azimuth"""
    sigma_elevation_deg: float = Field(0.3, gt=0, le=45)
    """degrees; the same of an elevation"""
    sigma_position_m: float = Field(50.0, gt=0)
    """m; the same of x, y and z"""
    sigma_doppler_m_s: float = Field(2.0, gt=0)
    """m/s; the same of a range rate"""
    extent_m: float = Field(0.0, ge=0)
    """m; standard deviation, in each direction, of the place on a target that its echo comes from"""
    skip_bad_rows: bool = False
    """invalid rows are left out and counted; false: they end the run"""
    estimator: Estimator = "imm"
    """kalman, converted: plots become unbiased positions; ekf, ukf, particle: range and angles stay; imm: two models"""
    model: Model | None = None
    """nearly constant velocity, nearly constant acceleration, Singer, coordinated turn; None: ct for imm, else cv"""
    detection_probability: float | None = Field(0.9, gt=0, lt=1)
    """probability that a scan shows a target; None: from the tracks so far"""
    clutter_density: float | None = Field(None, gt=0)
    """false plots per scan and unit of measurement space (m^2, m^3, m rad, ...); None: from unassociated plots"""
    clutter_map: bool = True
    """the density of false plots is learnt by place; false: it is the same everywhere"""
    max_speed: float = Field(400.0, gt=0)
    """m/s; fastest target; a new track's velocity is unknown by half of it in each direction"""
    accel: float = Field(8.0, gt=0)
    """m/s^2; standard deviation of a target's acceleration"""
    hold_s: float = Field(4.0, gt=0)
    """s; correlation time of the acceleration"""
    quiet_accel: float = Field(0.3, gt=0)
    """m/s^2; standard deviation of the acceleration in imm's quiet mode; its other mode is radar.model"""
    quiet_s: float = Field(900.0, gt=0)
    """s; mean time that imm's quiet mode lasts"""
    manoeuvre_s: float = Field(20.0, gt=0)
    """s; mean time that imm's other mode lasts"""
    agile: float = Field(0.01, ge=0, lt=1)
    """share of the targets that manoeuvre all the time, for which imm has modes of their own; 0: it has none"""
    particles: int = Field(2000, ge=2)
    """samples of each track in the particle filter"""
    resampling: Resampling = "systematic"
    """how particles are resampled; none: never; error-signal: near the plot (paper 003)"""
    glint: float = Field(0.0, ge=0, lt=1)
    """share of a plot's errors that are five times as large, for the particle filter"""
    euclidean_radius_m: float = Field(2000.0, gt=0)
    """m; gate of the euclidean distance"""
    unresolved: bool = True
    """targets nearer than a resolution cell to each other give one plot, and stay separate tracks"""
    cell_range_m: float | None = Field(None, gt=0)
    """m; side of a resolution cell in range; None: learnt, in standard deviations of the plots"""
    cell_azimuth_deg: float | None = Field(None, gt=0, le=90)
    """degrees; the same in azimuth"""
    cell_elevation_deg: float | None = Field(None, gt=0, le=90)
    """degrees; the same in elevation"""
    snr_db: float | None = Field(None, ge=0, le=60)
    """dB; mean SNR of targets, by which each track sets a detection threshold of its own; None: all plots are used"""
    pfa_max: float | None = Field(None, gt=0, le=1)
    """P_FA with which the plots were detected, the highest that tracks may set; None: from the weakest plot"""
    group_link_m: float | None = Field(None, gt=0)
    """m; plots no farther apart are one group, and groups are tracked; None: single targets"""
    group_merge_m: float | None = Field(None, gt=0)
    """m; groups whose middles are closer become one; None: radar.group_link_m"""
    life: Life = "llr"
    """what confirms a track, as tracker.life; in clutter the score (llr), which also ends tracks, is better"""
    coast_scans: int = Field(5, ge=1, le=62)
    """a track ends after this many scans without a plot"""
    unseen_s: float | None = Field(None, gt=0)
    """s; nor later than so long after its last plot; None: 10 s or coast_scans where a sensor may not see it"""
    trail_s: float = Field(60.0, ge=0)
    """s; length of a target's trail in rerun"""
