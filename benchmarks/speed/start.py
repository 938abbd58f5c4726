"""The cost of a start and the size of an installation.

CPU time of the imports, the time from the command to READY=1 of the service (on an in-process bus, with the demo's
calibration), the bytes of an installation by pip, and the installed size of the Debian package that `make deb` built,
compiled code included.
"""

import os
import shutil
import socket
import subprocess
import sys
import tempfile
import time
from importlib import metadata
from pathlib import Path
from typing import Any, Final

from packaging.requirements import Requirement

from benchmarks.speed.meter import CALIBRATION, ENVIRONMENT, ROOT, best_of

SETTINGS: Final = """\
signals = "springscale:reference"
calibration = "vehicle.json"
estimator = "cross_spectrum"
[bus]
interface = "virtual"
channel = "bench"
[web]
port = 0
[store]
directory = "state"
"""


IMPORTS: Final = {
    "gateway.cli": "import gateway.cli",
    "gateway.service.gateway": "from gateway.cli import springscale; springscale.get_command(None, 'run')",
}
"""Each as the command does it."""


def code_s(code: str) -> float:
    """CPU time of a fresh Python that runs this code, without the clearing up at its end."""
    command = [sys.executable, "-c", f"import os; {code}; os._exit(0)"]
    environment = os.environ | ENVIRONMENT
    found = best_of(5, lambda: {"code": subprocess.run(command, check=True, env=environment).returncode})
    return float(found["seconds"])


def ready_s(folder: Path) -> float:
    """From the command to READY=1."""
    shutil.copy(CALIBRATION, folder / "vehicle.json")
    (folder / "springscale.toml").write_text(SETTINGS)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as notified:
        notified.bind(str(folder / "notify"))
        notified.settimeout(60.0)
        environment = os.environ | ENVIRONMENT | {"NOTIFY_SOCKET": str(folder / "notify")}
        begun_s = time.monotonic()
        command = [sys.executable, "-m", "gateway", "run", "--config", str(folder / "springscale.toml")]
        service = subprocess.Popen(command, env=environment, stderr=subprocess.PIPE, text=True)
        try:
            while b"READY=1" not in notified.recv(4096):
                pass
            return time.monotonic() - begun_s
        except TimeoutError:
            service.terminate()
            raise SystemExit(f"the service did not get ready: {service.communicate()[1]}") from None
        finally:
            service.terminate()
            service.communicate(timeout=30.0)


def install_mb() -> dict[str, float]:
    """Megabytes of every package in a vehicle's installation, the largest first."""
    sizes = {"springscale": _bytes_under(ROOT / "gateway") + _bytes_under(ROOT / "dbc")}
    waiting = [("springscale", frozenset[str]())]
    while waiting:
        package, extras = waiting.pop()
        for wanted in map(Requirement, metadata.requires(package) or []):
            name = wanted.name.lower().replace("_", "-")
            if wanted.marker and not any(wanted.marker.evaluate({"extra": extra}) for extra in ("", *extras)):
                continue
            if name not in sizes:
                files = [Path(str(file.locate())) for file in metadata.files(name) or []]
                sizes[name] = sum(file.stat().st_size for file in files if file.is_file())
                waiting.append((name, frozenset(wanted.extras)))
    return {name: sizes[name] / 1e6 for name in sorted(sizes, key=lambda name: -sizes[name])}


def _bytes_under(folder: Path) -> float:
    return float(sum(f.stat().st_size for f in folder.rglob("*") if f.is_file() and "__pycache__" not in f.parts))


def package_mb() -> float | None:
    """Installed size of the vehicle's Debian package; None if none was built or it cannot be read."""
    package = max((ROOT / "build").glob("springscale_*.deb"), key=lambda one: one.stat().st_mtime, default=None)
    if package is None or shutil.which("dpkg-deb") is None:
        return None
    told = subprocess.run(
        ["dpkg-deb", "--field", package, "Installed-Size"], check=True, capture_output=True, text=True
    )
    return int(told.stdout) * 1024 / 1e6


def measure() -> dict[str, Any]:
    """All of it."""
    with tempfile.TemporaryDirectory() as folder:
        times = []
        for n in range(3):
            (Path(folder) / str(n)).mkdir()
            times.append(ready_s(Path(folder) / str(n)))
    sizes = install_mb()
    return {
        "imports_s": {name: code_s(code) - code_s("pass") for name, code in IMPORTS.items()},
        "ready_s": min(times),
        "package_mb": package_mb(),
        "install_mb": sum(sizes.values()),
        "largest_mb": dict(list(sizes.items())[:6]),
    }
