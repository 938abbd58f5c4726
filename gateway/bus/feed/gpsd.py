"""A satellite receiver behind gpsd: its JSON reports over TCP (gpsd_json(5)).

A TPV report has ``mode`` (0 and 1 no fix, 2 two dimensions, 3 three), and with a fix ``speed`` in m/s, ``lat`` and
``lon`` in degrees; a SKY report has ``uSat``, the satellites used.
"""

import contextlib
import json
import socket
from dataclasses import dataclass
from typing import Any, Final

from gateway.errors import BusError

WATCH: Final = b'?WATCH={"enable":true,"json":true}\n'
LONGEST_LINE: Final = 1 << 16  # chosen: far longer than a report of gpsd
CONNECT_S: Final = 3.0  # chosen: gpsd is on this computer or near


@dataclass(frozen=True, slots=True)
class Fix:
    """One report; speed and position are finite or None. mode as in dbc/springscale_reference.dbc: 0, 2 or 3."""

    mode: int
    speed_mps: float | None
    latitude_deg: float | None
    longitude_deg: float | None
    n_satellites: int


class Gpsd:
    """One connection; opened again by the next read after it broke."""

    def __init__(self, host: str, port: int) -> None:
        self.name = f"gpsd {host}:{port}"
        self._address = (host, port)
        self._socket: socket.socket | None = None
        self._rest = b""
        self._n_satellites = 0

    def read(self, timeout_s: float) -> list[Fix]:
        """Fixes that came within ``timeout_s``. Raises BusError if gpsd does not answer or hangs up."""
        try:
            if self._socket is None:
                self._socket = socket.create_connection(self._address, CONNECT_S)
                self._socket.sendall(WATCH)
            self._socket.settimeout(timeout_s)
            got = self._socket.recv(65_536)
        except TimeoutError:
            if self._socket is None:
                raise BusError(f"{self.name}: does not answer") from None
            return []
        except (OSError, UnicodeError) as fault:  # UnicodeError: a name that the domain name system cannot have
            self.close()
            raise BusError(f"{self.name}: {getattr(fault, 'strerror', None) or fault}") from None
        if not got or len(self._rest) > LONGEST_LINE:
            self.close()
            raise BusError(f"{self.name}: hung up" if not got else f"{self.name}: sends something that is not JSON")
        *lines, self._rest = (self._rest + got).split(b"\n")
        return [fix for line in lines if (fix := self._fix(line)) is not None]

    def close(self) -> None:
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.close()
        self._socket, self._rest = None, b""

    def _fix(self, line: bytes) -> Fix | None:
        """None unless it is a fix: other reports, and lines that are not JSON."""
        try:
            report: Any = json.loads(line)
        except (ValueError, RecursionError):
            return None
        if not isinstance(report, dict):
            return None
        if report.get("class") == "SKY" and isinstance(report.get("uSat"), int):
            self._n_satellites = report["uSat"]
        if report.get("class") != "TPV":
            return None
        mode = 3 if report.get("mode") == 3 else 2 if report.get("mode") == 2 else 0
        has_fix = mode > 0
        return Fix(
            mode,
            _number(report.get("speed"), 0.0, 200.0) if has_fix else None,
            _number(report.get("lat"), -90.0, 90.0) if has_fix else None,
            _number(report.get("lon"), -180.0, 180.0) if has_fix else None,
            min(max(self._n_satellites, 0), 64),
        )


def _number(reported: Any, least: float, most: float) -> float | None:
    return float(reported) if isinstance(reported, int | float) and least <= reported <= most else None
