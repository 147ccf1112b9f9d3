"""What vehicles look like decides who is who, and a vehicle that comes in is not the one that left."""

from dataclasses import replace

import numpy as np
from blob_scene import centred, confirmed_ids, default_tracker, events, scan_of

RED, WHITE = [80.0, 110.0, 200.0], [230.0, 128.0, 128.0]
FPS = 25.0


def after_a_gap(coloured, **settings):
    """Tracks of two vehicles side by side of which nothing is seen for 0.4 s, in which they exchange their lanes.

    coloured  whether their looks are known
    """
    tracker = default_tracker(**settings)
    seen = []
    for k in range(50):
        t = k / FPS
        swapped = t > 1.4
        y = (122, 130) if swapped else (118, 134)
        boxes = [centred(60 + 60 * t, y[0], 24, 6), centred(60 + 60 * t, y[1], 24, 6)]
        scan = scan_of(t, [] if 1.0 < t <= 1.4 else boxes)
        if coloured and len(scan):
            colours = np.array([WHITE, RED] if swapped else [RED, WHITE])
            scan = replace(scan, look=colours[np.argsort(np.argsort(scan.z[:, 1]))])
        seen.append(tracker.step(scan))
    return seen


def lane_of(tracks, track):
    """y of a track."""
    return tracks.xy[tracks.id == track][0, 1]


def test_two_vehicles_that_exchange_places_unseen_are_told_by_their_looks():
    by_place, by_look, off = after_a_gap(False), after_a_gap(True), after_a_gap(True, look=False)
    for seen in (by_place, by_look, off):
        assert confirmed_ids(seen) == {1, 2}
    for seen, stays in ((by_place, True), (by_look, False), (off, True)):
        above = min((1, 2), key=lambda track: lane_of(seen[20], track))
        assert (lane_of(seen[-1], above) < 126) == stays


def at_the_border(**settings):
    """A vehicle leaves over the left side, and in its place another one comes in; both are one blob meanwhile."""
    tracker = default_tracker(**settings)
    seen = []
    for k in range(75):
        t = k / FPS
        right = 120 - 80 * t if t < 1.2 else 24 + 80 * (t - 1.2)
        left = max(0.0, right - 50)
        seen.append(tracker.step(scan_of(t, [[left, 100, right - left, 25]])))
    return seen


def test_a_vehicle_that_comes_in_where_another_one_leaves_is_a_track_of_its_own():
    seen = at_the_border()
    assert len(confirmed_ids(seen)) == 2
    assert [track for _, track in events(seen, "delete")] == [1]
    assert len(confirmed_ids(at_the_border(relieve=False))) == 1
