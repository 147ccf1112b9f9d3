"""The road of a site, as a run needs it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vidtrack.traffic.footprint import Footprints

SITE_COPY = "site.toml"
"""Name of the copy of a site in the folder of a run."""


def footprints_of(site: Path | None, width: int, height: int) -> Footprints | None:
    """Where vehicles stand on the road of the site in a file; None without a site, or without a calibration in it.

    width, height  px of the pictures. Raises ConfigError for a bad file, or pictures of another shape than the site's.
    """
    if site is None:
        return None
    from vidtrack.traffic.calibration.calibrate import calibrated  # loads SciPy's optimisers
    from vidtrack.traffic.footprint import Footprints
    from vidtrack.traffic.site import read_site

    drawn = read_site(site).scaled(width, height)
    return None if drawn.calibration is None else Footprints(calibrated(drawn), (width, height))


def site_text(site: Path | None) -> str | None:
    """The text of a site's file; None without one. It was read by `footprints_of`."""
    return None if site is None else site.read_text(encoding="utf-8")
