"""A site while it is drawn: its mistakes, residuals, grid of metres and counts, as plain data for the page."""

from __future__ import annotations

from copy import deepcopy
from typing import Any

import numpy as np
from pydantic import ValidationError

from vidtrack.arrays.types import Floats, Ints
from vidtrack.errors import ConfigError, Error
from vidtrack.serve.site.file import Tree
from vidtrack.traffic.calibration.account import Account, examined
from vidtrack.traffic.calibration.ground import Ground
from vidtrack.traffic.calibration.homography import matrix
from vidtrack.traffic.calibration.metre_grid import metre_grid
from vidtrack.traffic.measures.recount import Recount
from vidtrack.traffic.site import Calibration, Camera, Fault, Site, faults_of


class Draft:
    """A site that is drawn over the rows of a run."""

    def __init__(self, recount: Recount) -> None:
        self._recount = recount
        self._examined: tuple[tuple[Camera, Calibration], Account | ConfigError] | None = None

    def look(self, tree: Tree, count: bool) -> dict[str, Any]:
        """What the page shows of a drawing.

        faults       key and words: what `read_site`, the calibration and the gates refuse; it cannot be saved so
        warnings     what the calibration says about its points, and why nothing is counted
        calibration  its residuals and grid; None where there is none, or none yet
        tally        with `count`: what is counted by all that is not at fault
        """
        site, faults = _usable(tree)
        account = None
        try:
            account = site and self._account(site)
        except ConfigError as error:
            faults.append(Fault(("calibration",), str(error)))
        found: dict[str, Any] = {"calibration": account and _shown(account)}
        found["warnings"] = list(account.report["warnings"]) if account else []
        if count and site is not None:
            try:
                tally = self._recount.of(*self._on_pictures(site))
            except Error as error:  # the run cannot be laid on this road; the drawing is none the worse
                found["warnings"].append(str(error))
            else:
                faults += tally.faults
                found["tally"] = {name: getattr(tally, name) for name in ("counts", "stays", "movements", "trips")}
        return found | {"faults": [{"key": list(fault.key), "words": fault.words} for fault in faults]}

    def paths(self, tree: Tree) -> tuple[Ints, Floats]:
        """(T,) numbers of corners and (N, 2) corners of all tracks' paths, in pixels of the site."""
        site, _ = _usable(tree)
        if site is None:
            return np.empty(0, np.int64), np.empty((0, 2))
        size, camera = self._recount.size, site.camera
        try:
            lengths, xy = self._recount.paths(*self._on_pictures(site))
        except Error:  # `look` says why
            lengths, xy = self._recount.paths(site.scaled(*size), None)
        return lengths, (xy + 0.5) * [camera.width / size[0], camera.height / size[1]] - 0.5

    def _account(self, site: Site) -> Account | None:
        """The account of the site's calibration, kept while it stays. Raises ConfigError."""
        if site.calibration is None:
            return None
        key = site.camera, site.calibration
        if self._examined is None or self._examined[0] != key:
            try:
                self._examined = key, examined(site)
            except ConfigError as error:
                self._examined = key, error
        found = self._examined[1]
        if isinstance(found, ConfigError):
            raise found
        return found

    def _on_pictures(self, site: Site) -> tuple[Site, Ground | None]:
        """The site on pictures of the run's size, and its road there; None: without metres."""
        drawn = site.scaled(*self._recount.size)
        try:
            account = self._account(site)
        except ConfigError:
            return drawn, None
        if account is None or drawn is site:
            return drawn, account.ground if account else None
        return drawn, examined(drawn).ground


def _usable(tree: Tree) -> tuple[Site | None, list[Fault]]:
    """The site without its parts that are at fault, and the faults; None where nothing is left."""
    tree, faults = deepcopy(tree), list[Fault]()
    while True:
        try:
            return Site.model_validate(tree), faults
        except ValidationError as error:
            found = faults_of(error)
            later = bool(faults)
            faults += [fault for fault in found if fault.key or not later]  # else what was left out is missed
            if not all(_left_out(tree, fault.key) for fault in found):
                return None, faults


def _left_out(tree: Tree, key: tuple[str, ...]) -> bool:
    """Take what is at fault out of the tree; whether that is possible."""
    if key == ():
        return tree.pop("sections", None) is not None or tree.pop("movements", None) is not None
    if key[0] == "site":
        if key[1:] == ("name",):
            tree["site"]["name"] = "site"
        return len(key) > 1 and key[1] not in ("width", "height") and (key[1] == "name" or _pop(tree["site"], key[1]))
    if key[0] in ("gates", "zones", "sections", "classes") and len(key) > 1:
        return _pop(tree[key[0]], key[1])
    return _pop(tree, key[0])


def _pop(part: Any, key: str) -> bool:
    """Take out a part, which a fault before this one may have done; whether it can be in there."""
    if isinstance(part, dict):
        part.pop(key, None)
    return isinstance(part, dict)


def _shown(account: Account) -> dict[str, Any]:
    report, ground = account.report, account.ground
    step, lines = metre_grid(ground, account.picture)
    plain = ground.lens is None
    shown = {
        "pairs": report["pairs"],
        "fitted": account.fitted.round(2).tolist() if report["pairs"] else [],
        "wrong": report["wrong"],
        "camera": report["camera"],
        "places": report["places"],
        "grid_m": step,
        "grid": [line.round(1).tolist() for line in lines],
        "metres": _to_metres(ground).tolist() if plain else None,
    }
    return {name: _known(value) for name, value in shown.items()}


def _known(value: Any) -> Any:
    """The value with None for numbers that are not known: JSON has no other word for it."""
    if isinstance(value, dict):
        return {key: _known(one) for key, one in value.items()}
    if isinstance(value, list):
        return [_known(one) for one in value]
    return None if isinstance(value, float) and not np.isfinite(value) else value


def _to_metres(ground: Ground) -> Floats:
    """(3, 3) from the picture to the road, homogeneous; positive where the road is seen."""
    view, plane = np.eye(3), np.eye(3)
    view[:2, 2], view[2, 2] = -ground.picture.origin, ground.picture.scale
    plane[0, 0] = plane[1, 1] = ground.plane.scale
    plane[:2, 2] = ground.plane.origin
    return np.asarray(plane @ np.linalg.inv(matrix(ground.k)) @ view)
