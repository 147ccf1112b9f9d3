"""ASTERIX for the tests, encoded by libasterix."""

import numpy as np


def layout(name):
    """A layout of libasterix, by its name in `asterix.generated`: slow to import, and not for who collects tests."""
    from asterix import generated

    return getattr(generated, name)


RADAR = (("SAC", 25), ("SIC", 201))


def plot(time_s, range_m, azimuth_deg, radar=RADAR, **items):
    """A record of CAT 048."""
    place = (("RHO", (range_m / 1852, "NM")), ("THETA", (azimuth_deg % 360, "°")))
    return layout("Cat_048_1_32").cv_record.create(
        {"010": radar, "140": (time_s % 86400, "s"), "020": ((1, 0, 0, 0, 0, None),), "040": place, **items}
    )


def mark(time_s, azimuth_deg=0.0, turn_s=None, radar=RADAR):
    """A block of CAT 034: a north mark, or a sector crossing."""
    items = {"010": radar, "000": 2 if azimuth_deg else 1, "030": (time_s % 86400, "s")}
    if azimuth_deg:
        items["020"] = (azimuth_deg, "°")
    if turn_s:
        items["041"] = (turn_s, "s")
    category = layout("Cat_034_1_29")
    return category.create([category.cv_record.create(items)]).unparse().to_bytes()


def block(*records):
    """A block of records of CAT 048."""
    return layout("Cat_048_1_32").create(list(records)).unparse().to_bytes()


def track(time_s, latitude, longitude, number, radar=RADAR):
    """A block of one record of CAT 062."""
    items = {
        "010": radar, "070": (time_s, "s"), "040": number,
        "105": (("LAT", (latitude, "°")), ("LON", (longitude, "°"))),
    }  # fmt: skip
    category = layout("Cat_062_1_20")
    return category.create([category.cv_record.create(items)]).unparse().to_bytes()


def sweeps(table, turn_s=4.0, begin_s=0.0):
    """Blocks of a plot table (columns by name), as an antenna sends them that turns in turn_s: a list of bytes.

    Each plot has the time at which the antenna passes it, and each turn begins with a north mark.
    """
    blocks = []
    for number in range(int(table["scan"].max()) + 1):
        north_s = begin_s + number * turn_s
        blocks.append(mark(north_s, turn_s=turn_s))
        rows = np.flatnonzero(table["scan"] == number)
        for row in rows[np.argsort(table["azimuth_deg"][rows] % 360)]:
            azimuth_deg = table["azimuth_deg"][row] % 360
            seen_s = north_s + azimuth_deg / 360 * turn_s
            blocks.append(block(plot(seen_s, table["range_m"][row], azimuth_deg)))
    return blocks


def two_feeds(blocks, behind):
    """Blocks as two feeds bring them, the second so many later; the first is out from a third to a half of them."""
    n = len(blocks)
    first = [[part] * (not n // 3 <= k < n // 2) for k, part in enumerate(blocks)]
    late = [blocks[k - behind : k - behind + 1] if k >= behind else [] for k in range(n)]
    both = [part for pair in zip(first, late, strict=True) for parts in pair for part in parts]
    return [*both, *blocks[n - behind :]]
