"""Options that commands share."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

Function = TypeVar("Function", bound=Callable[..., Any])


def common(output_help: str) -> Callable[[Function], Function]:
    """-o, --force, --quiet, -v: the same words in every command that writes results."""

    def decorate(function: Function) -> Function:
        for option in (
            click.option("-v", "--verbose", count=True, help="Say more; twice: everything."),
            click.option("-q", "--quiet", is_flag=True, help="Only errors: no progress, no warnings."),
            click.option("--force", is_flag=True, help="Replace the results in a folder that is not empty."),
            click.option("-o", "--output", type=click.Path(path_type=Path), metavar="DIR", help=output_help),
        ):
            function = option(function)
        return function

    return decorate


def seed_option(function: Function) -> Function:
    """--seed, where something is random."""
    return click.option(
        "--seed",
        type=click.IntRange(min=0),
        default=0,
        show_default=True,
        help="The same seed gives the same random numbers.",
    )(function)


def start_log(verbose: int, quiet: bool, who: str = "") -> None:
    """Warnings of the library to stderr, in the form of our own messages; `who`: the camera that they are about."""
    level = logging.ERROR if quiet else (logging.WARNING, logging.INFO, logging.DEBUG)[min(verbose, 2)]
    handler = logging.StreamHandler()
    about = f"{who}: " if who else ""
    handler.setFormatter(logging.Formatter(f"vidtrack: {about}%(levelname)s: %(message)s"))
    logging.addLevelName(logging.ERROR, "error")
    logging.addLevelName(logging.WARNING, "warning")
    logging.addLevelName(logging.INFO, "info")
    logger = logging.getLogger("vidtrack")
    handler.setLevel(level)
    logger.handlers = [handler]
    os.environ.setdefault("RUST_LOG", "off")  # rerun's log: what matters in it reaches the user as our own error
    logger.setLevel(min(level, logging.WARNING))


def announce_compiling(quiet: bool) -> None:
    """Say why the first run takes longer, before it does."""
    from vidtrack.compiled import first_run

    if not quiet and first_run():
        click.echo("vidtrack: compiling for this machine, once; it takes about half a minute", err=True)


def _recording(_context: click.Context, _option: click.Parameter, value: str | None) -> str | None:
    """Check the value of --rerun: a misspelt "spawn" must not become the name of a file."""
    if value is None or value in ("spawn", "serve") or value.endswith(".rrd"):
        return value
    raise click.BadParameter(f"{value!r} is not FILE.rrd, spawn or serve.")


def association_options(function: Function) -> Function:
    """--method, --distance, --rerun, --decisions: what tracking pictures and tracking plots have in common."""
    for option in (
        click.option("--decisions", is_flag=True, help="Write why each track got what it got."),
        click.option(
            "--rerun",
            metavar="FILE.rrd|spawn|serve",
            callback=_recording,
            help="Record or show everything in rerun.",
        ),
        click.option(
            "--distance",
            type=click.Choice(["mahalanobis", "decoupled", "euclidean"]),
            help="What decides which measurement is whose.  [default: mahalanobis]",
        ),
        click.option(
            "--method",
            type=click.Choice(["nn", "gnn", "generalized-nn", "sn", "psn", "pda", "jpda", "split", "mht"]),
            help="Association.  [default: gnn]",
        ),
    ):
        function = option(function)
    return function


def smooth_option(function: Function) -> Function:
    """--smooth, for sources that end."""
    return click.option(
        "--smooth", is_flag=True, default=None, help="Let each row know what came after it; rows appear later."
    )(function)


def settings_options(function: Function) -> Function:
    """--config and --set."""
    function = click.option(
        "--set", "assignments", multiple=True, metavar="A.B=VALUE", help="One setting; repeat for more."
    )(function)
    return click.option(
        "--config", "config_file", type=click.Path(path_type=Path), metavar="FILE.toml", help="Settings from a file."
    )(function)
