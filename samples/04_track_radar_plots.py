"""Track radar plots: range and azimuth, clutter and misses, from the same tracker as video.

python samples/04_track_radar_plots.py
"""

import numpy as np

import vidtrack as vt

RANGE_SIGMA, AZIMUTH_SIGMA, P_D, FALSE = 30.0, np.radians(0.2), 0.9, 5  # m, rad, per scan
sensor = vt.RangeAzimuth()
rng = np.random.default_rng(1)
tracker = vt.Tracker(
    model=vt.ConstantVelocity(accel=2.0, speed=200.0),  # m/s^2, m/s
    associate=vt.JPDA(),
    gate=vt.Gate(0.999),
    life=vt.LogRatio(coast_scans=5),
    detection_probability=P_D,
    clutter_density=FALSE / (20e3 * 2 * np.pi),  # per m and rad, the sensor's own units
)

# Two aircraft, one of them across north, where the azimuth jumps; a scan every 4 s.
for k in range(20):
    t = 4.0 * k
    truth = np.array([[-4e3 + 150 * t, 0.0, 12e3, 0.0], [9e3, 0.0, -8e3 + 180 * t, 0.0]])
    seen = sensor.h(truth, (0, 2))[rng.random(2) < P_D]
    seen = seen + rng.normal(size=seen.shape) * [RANGE_SIGMA, AZIMUTH_SIGMA]
    false = rng.uniform([0, -np.pi], [20e3, np.pi], (rng.poisson(FALSE), 2))
    R = np.diag([RANGE_SIGMA**2, AZIMUTH_SIGMA**2])
    tracks = tracker.step(vt.Scan(t=t, z=np.vstack([seen, false]), R=R, sensor=sensor))

print("id   east [km]  north [km]   velocity [m/s]   probability that it is a target")
known = tracks.status != vt.Status.TENTATIVE
for track_id, (x, y), (vx, vy), p in zip(
    tracks.id[known], tracks.xy[known] / 1e3, tracks.v[known], tracks.existence[known], strict=True
):
    print(f"{track_id:3d}  {x:8.2f}  {y:9.2f}    ({vx:4.0f}, {vy:4.0f})      {p:.4f}")
