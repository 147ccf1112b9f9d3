"""Bring your own detections: points with errors become tracks. For boxes there are vt.box_tracker and vt.box_scan.

python samples/02_bring_your_own_detections.py
"""

import numpy as np

import vidtrack as vt

rng = np.random.default_rng(1)
tracker = vt.Tracker(
    model=vt.ConstantVelocity(accel=40.0, cross=10.0, speed=100.0, hold_s=0.5),  # px/s^2 along and across, px/s
    gate=vt.Gate(0.999),
    life=vt.LifeCycle(confirm_hits=3, confirm_window=4, coast_s=1.0, coast_scans=None),
)

# Two vehicles cross at (160, 120); every tenth detection is missed, and now and then there is a false one.
for k in range(60):
    t = k / 15
    truth = np.array([[40.0 + 60.0 * t, 120.0], [160.0, 6.0 + 60.0 * t]])
    seen = (truth + rng.normal(scale=1.5, size=(2, 2)))[rng.random(2) < 0.9]
    false = rng.uniform([0, 0], [320, 240], (rng.poisson(0.2), 2))
    tracks = tracker.step(vt.Scan(t=t, z=np.vstack([seen, false]), R=2.25 * np.eye(2)))
    for event in tracks.events:
        if event.kind == "confirmed":
            print(f"{event.t:.2f} s: track {event.track_id} confirmed, {event.reason}")

print("id   x [px]        y [px]        velocity [px/s]")
known = tracks.status != vt.Status.TENTATIVE
for track_id, (x, y), (vx, vy), P in zip(
    tracks.id[known], tracks.xy[known], tracks.v[known], tracks.xy_cov[known], strict=True
):
    print(f"{track_id:2d}   {x:5.1f} ± {P[0, 0] ** 0.5:.1f}   {y:5.1f} ± {P[1, 1] ** 0.5:.1f}   ({vx:.0f}, {vy:.0f})")
