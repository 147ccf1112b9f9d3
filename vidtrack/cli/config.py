"""`vidtrack config`: the effective settings."""

from __future__ import annotations

from dataclasses import dataclass

import click

from vidtrack.cli.options import WithSettings, common, receives, settings_options, start_log


@dataclass(frozen=True, kw_only=True)
class ConfigOptions(WithSettings):
    """Options of `vidtrack config`."""

    explain: bool


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
@receives(ConfigOptions)
def command(options: ConfigOptions) -> None:
    """Print the effective settings as TOML, ready for --config. Settings that are None are commented out."""
    from vidtrack.config.explain import as_toml
    from vidtrack.output.folder import writing

    start_log(options.verbose, options.quiet)
    text = as_toml(options.settings(), explain=options.explain)
    folder = options.folder("config")
    if folder is None:
        click.echo(text, nl=False)
        return
    path = folder / "settings.toml"
    with writing(path):
        path.write_text(text, encoding="utf-8")
