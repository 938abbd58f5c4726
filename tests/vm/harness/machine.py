"""A small Linux machine with CAN and systemd: boot it, run commands in it, pull its plug."""

import contextlib
import json
import os
import select
import socket
import subprocess
import time
from pathlib import Path
from typing import Final

from vm.harness.backend import Backend, Wiring
from vm.harness.image import kept_image

AGENT_PORT: Final = 9999
BOOT_S: Final = 240.0
FURTHER_DISK: Final = "256M"  # sparse


class GuestError(RuntimeError):
    """A command in the guest failed, or the guest did not answer."""


class Machine:
    """One guest with disks of its own, one with its system, two empty; they survive power cuts until :meth:`close`.

    Host and guest share a network of two addresses that nobody else sees.
    """

    def __init__(self, backend: Backend, folder: Path) -> None:
        self.backend = backend
        self.console = folder / "console.log"
        self.boot_s = 0.0
        number = os.getpid() % 256
        self.host_address, self.address = f"198.18.{number}.1", f"198.18.{number}.2"
        image = kept_image(backend.name)
        self.further_disks = (folder / "second.img", folder / "third.img")
        tap, address = f"springscale{number}", f"{self.address}/30"
        self._wiring = Wiring(image, folder / "root.img", self.further_disks, tap, address)
        subprocess.run(["cp", "--sparse=always", image / "root.img", self._wiring.disk], check=True)
        for disk in self.further_disks:
            subprocess.run(["truncate", "--size", FURTHER_DISK, disk], check=True)
        self._make_network()
        self._process: subprocess.Popen[bytes] | None = None
        self._last_breath = -1

    def boot(self) -> None:
        """Start and wait until commands can be run."""
        begun_s = time.monotonic()
        self._last_breath, write_end = os.pipe()
        # Killing the monitor alone would leave the guest's processes behind: they live in a PID namespace that dies
        # with it. The pipe ends when the last of them is gone.
        with self.console.open("ab") as console:
            self._process = subprocess.Popen(
                ["setpriv", "--pdeathsig", "KILL", "unshare", "--pid", "--mount", "--mount-proc", "--fork",
                 "--kill-child=KILL", *self.backend.command(self._wiring)],
                stdin=subprocess.DEVNULL, stdout=console, stderr=subprocess.STDOUT, pass_fds=[write_end],
                env={**os.environ, "TMPDIR": "/dev/shm", "HOME": "/tmp"},
            )  # fmt: skip
        os.close(write_end)
        while True:
            with contextlib.suppress(OSError, GuestError):  # not up yet, or up and too busy to answer
                self.run("true", timeout_s=2.0)
                break
            self._require_alive(begun_s)
            time.sleep(0.1)
        self.boot_s = time.monotonic() - begun_s
        self.run("systemctl is-system-running --wait || true", timeout_s=BOOT_S)

    def _make_network(self) -> None:
        """The host's end; it outlives the guest, which may take its own end down and up."""
        tap = self._wiring.tap
        left_by_a_killed_run = f"link delete {tap}"
        subprocess.run(["ip", *left_by_a_killed_run.split()], stderr=subprocess.DEVNULL, check=False)
        for command in (
            f"tuntap add {tap} mode tap",
            f"address add {self.host_address}/30 dev {tap}",
            f"link set {tap} up",
        ):
            subprocess.run(["ip", *command.split()], check=True)

    def _require_alive(self, begun_s: float) -> None:
        assert self._process is not None
        if self._process.poll() is not None or time.monotonic() - begun_s > BOOT_S:
            self.cut_power()
            raise GuestError(f"the guest did not come up:\n{self.console.read_text(errors='replace')[-2000:]}")

    def cut_power(self) -> None:
        """End it at once: what had not reached its disk is lost."""
        if self._process is None:
            return
        self._process.kill()
        self._process.wait()
        select.select([self._last_breath], [], [], 15.0)  # two guests must never write to one disk
        os.close(self._last_breath)
        self._process = None

    def close(self) -> None:
        """End it and throw its disk and network away."""
        self.cut_power()
        subprocess.run(["ip", "link", "delete", self._wiring.tap], check=False)
        for disk in (self._wiring.disk, *self.further_disks):
            disk.unlink(missing_ok=True)

    def run(self, command: str, *, timeout_s: float = 60.0, check: bool = True) -> str:
        """Output of a shell command in the guest. Raises GuestError where it fails, OSError without an answer."""
        answer = self._ask({"run": command, "timeout_s": timeout_s}, timeout_s)
        if check and answer["code"] != 0:
            raise GuestError(f"{command}\nended with {answer['code']}:\n{answer['out']}{answer['err']}")
        return str(answer["out"])

    def succeeds(self, command: str) -> bool:
        """Whether a command ends with 0."""
        return self._ask({"run": command, "timeout_s": 60.0}, 60.0)["code"] == 0

    def write(self, path: str, content: bytes | str) -> None:
        """A file in the guest."""
        octets = content.encode() if isinstance(content, str) else content
        answer = self._ask({"write": path, "n_bytes": len(octets)}, 120.0, octets)
        if answer["code"]:
            raise GuestError(f"{path}: {answer['err']}")

    def _ask(self, request: dict[str, object], timeout_s: float, content: bytes = b"") -> dict[str, object]:
        with socket.create_connection((self.address, AGENT_PORT), timeout_s + 5.0) as connection:
            connection.sendall(json.dumps(request).encode() + b"\n" + content)
            line = connection.makefile().readline()
        if not line:
            raise ConnectionError("the guest gave no answer")
        return json.loads(line)
