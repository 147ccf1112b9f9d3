"""`vidtrack config`: the effective settings."""

from __future__ import annotations

from pathlib import Path

import click

from vidtrack.cli.options import settings_options


@click.command(
    name="config",
    epilog="""\b
Examples:
  vidtrack config > settings.toml
  vidtrack config --explain
  vidtrack config --config settings.toml --set tracker.coast_s=2""",
)
@click.option("--explain", is_flag=True, help="Say what each setting does, in which unit and range.")
@settings_options
def command(explain: bool, config_file: Path | None, assignments: tuple[str, ...]) -> None:
    """Print the effective settings as TOML, ready for --config. Settings taken from the data are commented out."""
    from vidtrack.config import load
    from vidtrack.explain import as_toml

    click.echo(as_toml(load(config_file, assignments), explain=explain), nl=False)
