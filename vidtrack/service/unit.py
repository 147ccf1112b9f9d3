"""The unit by which systemd runs vidtrack."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from vidtrack.errors import ConfigError

FOLDER = "/etc/systemd/system"


@dataclass(frozen=True, slots=True)
class Unit:
    """A service.

    name         of the unit, its folder in /var/lib, and its folder of compiled kernels in /var/cache
    user         under which it runs
    command      the program with its arguments
    environment  file with NAME=VALUE lines, such as passwords; it need not exist

    Raises ConfigError for a name that is none.
    """

    name: str
    user: str
    command: Sequence[str]
    environment: str

    def __post_init__(self) -> None:
        for what, name in (("name", self.name), ("user", self.user)):
            if not re.fullmatch(r"[A-Za-z0-9_][A-Za-z0-9_-]*", name):
                raise ConfigError(f"{what} {name!r}: use letters, digits, _ and -")

    @property
    def path(self) -> str:
        """Its file."""
        return f"{FOLDER}/{self.name}.service"

    def text(self) -> str:
        """The content of the file."""
        return f"""[Unit]
Description=vidtrack: counts the traffic before cameras
Wants=network-online.target
After=network-online.target time-sync.target
StartLimitIntervalSec=0

[Service]
Type=notify
NotifyAccess=main
ExecStart={" ".join(map(_quoted, self.command))}
User={self.user}
SupplementaryGroups=video
StateDirectory={self.name}
CacheDirectory={self.name}
WorkingDirectory=%S/{self.name}
Environment=NUMBA_CACHE_DIR=%C/{self.name}
EnvironmentFile=-{self.environment.replace("%", "%%")}
Restart=on-failure
RestartSec=5
RestartPreventExitStatus=2
WatchdogSec=60
KillMode=mixed
TimeoutStopSec=10
NoNewPrivileges=yes
PrivateTmp=yes
ProtectSystem=full

[Install]
WantedBy=multi-user.target
"""


def _quoted(argument: str) -> str:
    """One argument of ExecStart (systemd.service(5), command lines)."""
    if any(ord(letter) < 32 for letter in argument):
        raise ConfigError(f"{argument!r} cannot stand in a unit: it contains a control character")
    text = argument.replace("%", "%%").replace("$", "$$").replace("\\", "\\\\").replace('"', '\\"')
    return text if re.fullmatch(r"[\w@%+=:,./-]+", text, re.ASCII) else f'"{text}"'
