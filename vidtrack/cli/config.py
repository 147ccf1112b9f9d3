"""`vidtrack config`: the effective settings."""

from __future__ import annotations

from pathlib import Path

import click

from vidtrack.cli.options import common, settings_options, start_log


@click.command(
    name="config",
    epilog="""\b
Examples:
  vidtrack config > settings.toml
  vidtrack config --explain
  vidtrack config --config settings.toml --set tracker.coast_s=2""",
)
@click.option("--explain", is_flag=True, help="Say what each setting does, in which unit and range.")
@common("Folder for settings.toml.  [default: printed]")
@settings_options
def command(
    explain: bool,
    output: Path | None,
    force: bool,
    quiet: bool,
    verbose: int,
    config_file: Path | None,
    assignments: tuple[str, ...],
) -> None:
    """Print the effective settings as TOML, ready for --config. Settings that are None are commented out."""
    from vidtrack.config import load
    from vidtrack.explain import as_toml
    from vidtrack.output.folder import open_folder, writing

    start_log(verbose, quiet)
    text = as_toml(load(config_file, assignments), explain=explain)
    if output is None:
        click.echo(text, nl=False)
        return
    path = open_folder(output, "config", force) / "settings.toml"
    with writing(path):
        path.write_text(text, encoding="utf-8")
