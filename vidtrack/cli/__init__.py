"""The command line. Each command is a module, imported when it is called."""

from __future__ import annotations

import signal
import sys
from importlib import import_module
from importlib.metadata import version

import click

from vidtrack.cli.signals import Terminated, terminate
from vidtrack.errors import Error

COMMANDS = {
    "track": "Tracks from a video, an image folder or stored detections.",
    "live": "Tracks from a camera or a stream, until stopped.",
    "batch": "Tracks of many files, on all cores or a cluster; goes on where it stopped.",
    "service": "A live run as a service of the machine.",
    "site": "Draw a site's gates, zones and points over the tracks of a run.",
    "calibrate": "Check what a site's calibration is worth.",
    "measure": "Traffic figures of a site from finished runs.",
    "report": "A site's report as a page, pictures and spreadsheets.",
    "review": "Look at counted crossings, and correct them.",
    "doctor": "Look at a source, and say which setting will hurt.",
    "radar": "Tracks from a table of radar plots.",
    "fuse": "One picture from the tracks of several radar runs.",
    "simulate": "Draw a traffic video or radar plots with exact truth.",
    "eval": "Score tracks against truth.",
    "predict": "Track error of a radar filter in clutter, before there is a plot.",
    "threshold": "The detection threshold that suits a tracker best.",
    "reproduce": "Figures and tables of the papers, ours beside theirs.",
    "export": "Tracks in metres for other programs: GeoJSON, SUMO, SSAM and more.",
    "validate": "Compare counted crossings with a count by hand.",
    "view": "Look at a finished run in rerun.",
    "repair": "Make a killed run's files whole.",
    "config": "Show the settings and what each one does.",
}


class _Commands(click.Group):
    """Imports only the called command, so that --help is fast."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(COMMANDS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in COMMANDS:
            return None
        command = import_module(f"vidtrack.cli.{name.replace('-', '_')}").command
        assert isinstance(command, click.Command)
        command.short_help = COMMANDS[name]
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        with formatter.section("Commands"):
            formatter.write_dl(list(COMMANDS.items()))


@click.command(
    cls=_Commands,
    epilog="""\b
Examples:
  vidtrack track traffic.avi
  vidtrack track traffic.mp4 --line gate:320,0,320,360 --video annotated.mp4
  vidtrack simulate junction -o junction
Each command has its own --help.""",
)
@click.version_option(version("vidtrack"), prog_name="vidtrack")
def cli() -> None:
    """Vehicle tracks from traffic video, on a plain CPU."""


def main() -> None:
    """Run a command; every error becomes one line and an exit code.

    0 done, 1 stopped early, 2 wrong usage, 3 bad input, 130 Ctrl-C, 143 SIGTERM.
    """
    signal.signal(signal.SIGTERM, terminate)
    try:
        code = cli.main(prog_name="vidtrack", standalone_mode=False)
    except Error as error:
        code = _report_error(str(error), error.exit_code)
    except click.ClickException as error:
        error.show()
        code = 2
    except (KeyboardInterrupt, click.Abort):
        code = _report_error("interrupted", 130)
    except Terminated:
        code = _report_error("terminated", 143)
    except OSError as error:  # for example a full disk or a read-only folder, without a more specific error
        place = f" {error.filename}" if error.filename else ""
        code = _report_error(f"cannot read or write{place}: {error.strerror or error}", 1)
    sys.exit(code)


def _report_error(message: str, code: int) -> int:
    click.echo(f"vidtrack: {message}", err=True)
    return code
