"""`vidtrack service`: installs a live run as a service of systemd."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from vidtrack.cli.options import receives
from vidtrack.errors import ConfigError, OutputError

if TYPE_CHECKING:
    from vidtrack.service.unit import Unit

_NAME = click.option("--name", default="vidtrack", show_default=True, help="Of the service.")
_DRY_RUN = click.option("--dry-run", is_flag=True, help="Print what would be done, and do nothing.")


@dataclass(frozen=True, kw_only=True)
class InstallOptions:
    """Options of `vidtrack service install`."""

    name: str
    user: str
    environment: str | None
    dry_run: bool
    arguments: tuple[str, ...]


@dataclass(frozen=True, kw_only=True)
class UninstallOptions:
    """Options of `vidtrack service uninstall`."""

    name: str
    dry_run: bool


@click.group(
    name="service",
    epilog="""\b
Examples:
  vidtrack service install --dry-run -- live /etc/vidtrack/cameras.toml -o results --keep 30d --http 8080
  sudo vidtrack service install --user vidtrack -- live /etc/vidtrack/cameras.toml -o results --keep 30d
  sudo vidtrack service uninstall""",
)
def command() -> None:
    """Run vidtrack live as a service: started with the machine, watched, restarted."""


@command.command(name="install", context_settings={"ignore_unknown_options": True})
@_NAME
@click.option("--user", default="vidtrack", show_default=True, help="Under which it runs.")
@click.option(
    "--environment",
    metavar="FILE",
    help="File of NAME=VALUE lines with passwords, such as VIDTRACK_TOKEN.  [default: /etc/NAME/environment]",
)
@_DRY_RUN
@click.argument("arguments", metavar="-- live SOURCE...", nargs=-1, required=True)
@receives(InstallOptions)
def install(options: InstallOptions) -> int:
    """Install and start a service that runs `vidtrack live SOURCE...`.

    Relative paths of results are below /var/lib/NAME, which belongs to the service. A camera that cannot be opened at
    the start is waited for.
    """
    from vidtrack.service.unit import Unit

    environment = options.environment or f"/etc/{options.name}/environment"
    unit = Unit(options.name, options.user, [sys.executable, "-m", "vidtrack", *_live(options.arguments)], environment)
    if options.dry_run:
        click.echo(unit.text(), nl=False)
        return 0
    _check_user(unit)
    for folder in ("/tmp", "/var/tmp"):
        if Path(sys.executable).is_relative_to(folder):
            raise ConfigError(f"{sys.executable} lies in {folder}; a service has one of its own: install it elsewhere")
    try:
        Path(unit.path).write_text(unit.text(), encoding="utf-8")
    except OSError as error:
        raise OutputError(f"cannot write {unit.path}: {error.strerror}; call it as root, or use --dry-run") from None
    for order in (["daemon-reload"], ["enable", "--now", unit.name]):
        _systemctl(order)
    click.echo(unit.path)
    return 0


@command.command(name="uninstall")
@_NAME
@_DRY_RUN
@receives(UninstallOptions)
def uninstall(options: UninstallOptions) -> int:
    """Stop a service and remove its unit; its results stay."""
    from vidtrack.service.unit import Unit

    unit = Unit(options.name, "root", [], "")
    path = Path(unit.path)
    if options.dry_run:
        click.echo(f"systemctl disable --now {unit.name}\nrm {path}\nsystemctl daemon-reload")
        return 0
    if not path.exists():
        raise ConfigError(f"there is no service {options.name}: {path} does not exist")
    _systemctl(["disable", "--now", unit.name])
    try:
        path.unlink()
    except OSError as error:
        raise OutputError(f"cannot remove {path}: {error.strerror}; call it as root") from None
    _systemctl(["daemon-reload"])
    return 0


def _live(arguments: tuple[str, ...]) -> list[str]:
    """The arguments of `vidtrack live`, checked, with whole paths of lists of cameras.

    Raises ConfigError for what a service cannot do, click.UsageError for wrong options.
    """
    from vidtrack.cli.live import command as live
    from vidtrack.cli.live_cameras import are_many
    from vidtrack.output.events.address import secret_parts
    from vidtrack.video.live.address import secrets

    if arguments[0] != "live":
        raise ConfigError(f"a service runs vidtrack live, not {arguments[0]!r}; write: -- live SOURCE...")
    given = live.make_context("vidtrack live", list(arguments[1:]), obj=None).params
    if given["output"] is None:
        raise ConfigError("a service needs -o DIR: after a restart its results continue there")
    if given["roll"] is None and not given["keeps"] and given["site"] is None:
        raise ConfigError("a service needs --roll or --keep: only results in parts continue after a restart")
    hidden = [text for source in given["sources"] for text in secrets(source)]
    hidden += secret_parts(given["mqtt"], given["webhook"])
    if any(text in argument for text in (*hidden, *_tokens(given)) for argument in arguments):
        raise ConfigError(
            "everyone may read a unit: write addresses with passwords into a list of cameras that only the user of the "
            "service may read, and other passwords into the file of --environment"
        )
    found = [str(Path(one).absolute()) if one.endswith(".toml") and Path(one).exists() else one for one in arguments]
    return found if are_many(given["sources"]) else [*found, "--set", "live.retry_first=true"]


def _tokens(given: dict[str, object]) -> list[str]:
    return [str(given[name]) for name in ("http_token", "webhook_token") if given[name]]


def _check_user(unit: Unit) -> None:
    import pwd

    try:
        pwd.getpwnam(unit.user)
    except KeyError:
        raise ConfigError(
            f"there is no user {unit.user}; make one: useradd --system --home-dir /var/lib/{unit.name} {unit.user}"
        ) from None


def _systemctl(order: list[str]) -> None:
    try:
        result = subprocess.run(["systemctl", *order], capture_output=True, text=True, check=False)
    except OSError as error:
        raise ConfigError(f"cannot call systemctl: {error.strerror}; this machine is not run by systemd") from None
    if result.returncode:
        raise ConfigError(f"systemctl {' '.join(order)} failed: {' '.join(result.stderr.split())}")
