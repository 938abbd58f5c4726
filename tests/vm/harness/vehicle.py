"""The box in the vehicle: the machine with the package under test installed, seen as its owner and as a client."""

import json
import ssl
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final

import httpx
import trustme
from vm.harness.machine import Machine

CONFIG: Final = "/etc/springscale/springscale.toml"
STATE: Final = "/var/lib/springscale"
SETTINGS: Final = """\
signals = "springscale:reference"
calibration = "vehicle.json"
[vehicle]
id = "van-17"
[bus]
channel = "vcan0"
[batch]
window_s = 20.0
silence_s = 3.0
provisional_every_s = 0.0
[web]
host = "0.0.0.0"
tls_certificate = "web.pem"
tls_key = "web.pem"
"""
# What docs/deployment.md tells whoever opens the API to a network of his
FIREWALL: Final = "[Service]\nIPAddressAllow=198.18.0.0/16\n"
NO_START_LIMIT: Final = "[Unit]\nStartLimitIntervalSec=0\n"
WAIT_S: Final = 90.0
POLL_S: Final = 0.25
AT_ONCE: Final = "--property CPUSchedulingPolicy=fifo --property CPUSchedulingPriority=10"
PLAY: Final = "canplayer vcan0=can0 -I"  # as docs/deployment.md tells: what a log has of can0 goes onto vcan0
HEARD: Final = "/root/heard.log"  # in the guest

Answer = dict[str, Any]


class Vehicle:
    """One springscale service on one machine, asked over HTTP from outside it."""

    def __init__(self, machine: Machine) -> None:
        self.machine = machine
        self.run = machine.run
        self._token = ""
        self._is_changed = False
        authority = trustme.CA()
        self._certificate = authority.issue_cert(machine.address, "127.0.0.1").private_key_and_cert_chain_pem
        self.trust = ssl.create_default_context()
        authority.configure_trust(self.trust)
        self.url = f"https://{machine.address}:8000"

    def is_installed(self) -> bool:
        """Whether the package is there."""
        return self.machine.succeeds("dpkg-query --show --showformat '${Status}' springscale | grep -q 'ok installed'")

    def install(self, package: Path) -> None:
        """Installs the service as docs/deployment.md says: package, virtual bus, configuration, token, start."""
        self.machine.write(f"/root/{package.name}", package.read_bytes())
        self.run(f"dpkg --install /root/{package.name}", timeout_s=300.0)
        self.run("cp /usr/share/springscale/network/vcan0.* /etc/systemd/network/ && networkctl reload")
        self.drop_in("firewall", FIREWALL)
        self.drop_in("no-start-limit", NO_START_LIMIT)
        self.run("cp /usr/lib/springscale/gateway/demo/paper_van.json /etc/springscale/vehicle.json")
        self.machine.write("/etc/springscale/web.pem", self._certificate.bytes())
        self.run("chgrp springscale /etc/springscale/web.pem; chmod 640 /etc/springscale/web.pem")
        self.configure(SETTINGS)
        self._token = self.run(f"springscale token create test --scope operate --config {CONFIG}").strip()
        self.run("systemctl enable --now springscale", timeout_s=90.0)
        self._is_changed = False

    def configure(self, settings: str) -> None:
        """Write springscale.toml; a restart or reload applies it."""
        self._is_changed = True
        self.machine.write(CONFIG, settings)

    def drop_in(self, name: str, content: str | None) -> None:
        """Add a drop-in of the unit, or remove it."""
        self._is_changed = True
        folder = "/etc/systemd/system/springscale.service.d"
        self.run(f"mkdir -p {folder}; rm -f {folder}/{name}.conf")
        if content is not None:
            self.machine.write(f"{folder}/{name}.conf", content)
        self.run("systemctl daemon-reload")

    def restore(self) -> None:
        """Restores the state that every test starts from: silent bus up, settings and unit as installed, service
        running.

        A start costs seconds of an emulated processor, so only what was changed is begun anew.
        """
        self.stop_playing()
        if not self.machine.succeeds("ip link set vcan0 up"):
            self.run("systemctl restart systemd-networkd")
        if self._is_changed:
            self.configure(SETTINGS)
            self.drop_in("test", None)
            self._is_changed = False
            self.restart()
        elif self.run("systemctl is-active springscale || true").strip() != "active":
            self.restart()
        self.wait_until(lambda status: True)

    def restart(self) -> None:
        """Restart the service; returns once it is ready."""
        self.run("systemctl reset-failed springscale; systemctl restart springscale", timeout_s=90.0)

    def get(self, path: str, **query: Any) -> Answer:
        """An answer of the API as an outside client gets it. Raises httpx.TransportError where nobody answers."""
        response = httpx.get(
            f"{self.url}/api/v1/{path}",
            verify=self.trust,
            params=query,
            headers={"authorization": f"Bearer {self._token}"},
            timeout=10.0,
        )
        response.raise_for_status()
        return response.json()

    def send(self, method: str, path: str, content: object = None, kind: str = "application/json") -> Answer:
        """The answer to a change, which is JSON unless it is a text. Raises httpx.HTTPStatusError for a refusal."""
        response = httpx.request(
            method,
            f"{self.url}/api/v1/{path}",
            verify=self.trust,
            content=content if isinstance(content, str) else json.dumps(content),
            headers={"authorization": f"Bearer {self._token}", "content-type": kind},
            timeout=30.0,
        )
        response.raise_for_status()
        return response.json()

    def status(self) -> Answer:
        """GET status."""
        return self.get("status")

    def n_frames(self) -> int:
        """Frames the service counted since its start."""
        return int(self.status()["bus"]["n_frames"])

    def wait_for_frames(self, n_frames: int, timeout_s: float = WAIT_S) -> float:
        """Seconds until the service counted this many since its start; fails where there are more."""
        seconds = self.wait_for(lambda: self.n_frames() >= n_frames, timeout_s)
        assert self.n_frames() == n_frames
        return seconds

    def records(self) -> list[Answer]:
        """Every estimate and rejection, oldest first, from the API's pages."""
        items: list[Answer] = []
        page = self.get("estimates", limit=1000)
        while True:
            items += page["items"]
            if page["next_cursor"] is None or not page["items"]:
                return items
            page = self.get("estimates", limit=1000, cursor=page["next_cursor"])

    def wait_until(self, is_so: Callable[[Answer], bool], timeout_s: float = WAIT_S) -> float:
        """Seconds until the status satisfied ``is_so``; an unanswered request counts as not yet."""
        return self.wait_for(lambda: is_so(self.status()), timeout_s)

    def wait_for(self, is_so: Callable[[], bool], timeout_s: float = WAIT_S) -> float:
        """Seconds until ``is_so`` held. Raises TimeoutError with what the service said last."""
        begun_s = time.monotonic()
        while time.monotonic() - begun_s < timeout_s:
            try:
                if is_so():
                    return time.monotonic() - begun_s
            except (httpx.HTTPError, OSError):
                pass
            time.sleep(POLL_S)
        raise TimeoutError(f"not within {timeout_s} s; the journal ends with\n{self.journal(15)}")

    def journal(self, n_lines: int = 50) -> str:
        """The newest lines of the service's log."""
        return self.run(f"journalctl --unit springscale --no-pager --output cat --lines {n_lines}")

    def pid(self) -> int:
        """The service's main process."""
        return int(self.run("systemctl show --property MainPID --value springscale"))

    def n_restarts(self) -> int:
        """The number of times that systemd had to restart the service."""
        return int(self.run("systemctl show --property NRestarts --value springscale"))

    def put_log(self, log: Path) -> str:
        """A log of the host in the guest; its path there."""
        path = f"/root/{log.name}"
        self.machine.write(path, log.read_bytes())
        return path

    def play(self, log: str) -> None:
        """Begin to send a log onto vcan0 in real time; returns at once.

        The player comes before everything else on the guest's one processor: a sensor would not wait either.
        """
        self.run(f"systemd-run --quiet --collect --unit player {AT_ONCE} {PLAY} {log}")

    def play_pulses(self, log: str, pause_s: float) -> None:
        """Begin to send a short log again and again, with silence between."""
        loop = f"while :; do {PLAY} {log}; sleep {pause_s}; done"
        self.run(f"systemd-run --quiet --collect --unit player {AT_ONCE} sh -c '{loop}'")

    def listen(self) -> None:
        """Begin to record vcan0 with candump, without a trace of what was there before."""
        self.stop_listening()
        self.run(f"rm -f {HEARD}; systemd-run --quiet --collect --unit witness sh -c 'exec candump -L any > {HEARD}'")
        self.wait_for(lambda: self.machine.succeeds(f"test -e {HEARD}"))
        self.run("sleep 0.5")

    def stop_listening(self) -> None:
        """End the recording in HEARD."""
        self.run("systemctl stop witness 2>/dev/null || true")

    def stop_playing(self) -> None:
        """End what :meth:`play` began, if it is not over."""
        self.run("systemctl stop player 2>/dev/null || true")

    def stored(self, *kinds: str) -> list[Answer]:
        """Every record of these kinds (all that windows gave) in the database file itself, oldest first, after SQLite's
        own check of it.
        """
        kinds = kinds or ("estimate", "rejection", "remainder")
        marks = ", ".join("?" * len(kinds))
        script = (
            f"import json, sqlite3; c = sqlite3.connect('file:{STATE}/springscale.db?mode=ro', uri=True);"
            "print(c.execute('PRAGMA integrity_check').fetchone()[0]);"
            f"rows = c.execute('SELECT text FROM journal WHERE kind IN ({marks}) ORDER BY seq', {kinds!r});"
            "print(json.dumps([json.loads(t) for t, in rows]))"
        )
        verdict, records = self.run(f'python3 -c "{script}"').strip().split("\n")
        assert verdict == "ok"
        return json.loads(records)
