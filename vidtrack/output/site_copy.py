"""site.toml: the site as it was when the run began."""

from __future__ import annotations

from pathlib import Path

from vidtrack.output.folder import replacing
from vidtrack.output.sink import Step
from vidtrack.traffic.metres import SITE_COPY


class SiteCopy:
    """Sink that writes the text of the site with the first step: a run that never begins leaves its folder empty."""

    def __init__(self, folder: Path, text: str) -> None:
        self._path = folder / SITE_COPY
        self._text: str | None = text

    def step(self, step: Step) -> None:
        """Write the copy once."""
        if self._text is not None:
            with replacing(self._path) as new:
                new.write_text(self._text, encoding="utf-8")
            self._text = None

    def close(self) -> None:
        """Do nothing: the copy is complete."""
