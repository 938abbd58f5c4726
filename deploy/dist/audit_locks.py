"""Known weaknesses of the locked packages that are shipped or that build what is shipped: `make audit`.

Asks OSV through pip-audit, which resolves and installs nothing. Exits with 1 where something is known, or where nobody
could be asked; with --advisory, as `make check` calls it, it tells the same and exits with 0: whoever works offline, or
on the day of somebody else's advisory, can still check their change.
"""

import argparse
import json
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

PROJECT: Final = Path(__file__).resolve().parents[2]
LOCKS: Final = ("requirements-workbench.txt", "requirements-build.txt")  # a vehicle's packages are among a desk's
SERVICE: Final = "https://api.osv.dev/v1/query"
ANSWER_S: Final = 10
ALL_ANSWERS_S: Final = 120.0


class NotAskedError(Exception):
    """Nobody could be asked; the sentence says why."""


def main() -> None:
    """Tell what is known; exit as the module says."""
    arguments = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    arguments.add_argument("--advisory", action="store_true", help="exit with 0 whatever is found")
    arguments.add_argument("--service", default=SERVICE, help="OSV's query interface")
    arguments.add_argument("locks", nargs="*", type=Path, default=[PROJECT / lock for lock in LOCKS])
    asked = arguments.parse_args()
    try:
        packages = audited(asked.locks, asked.service)
    except NotAskedError as fault:
        names = " ".join(lock.name for lock in asked.locks)
        print(f"audit: NOT CHECKED: {names}: {asked.service} could not be asked: {fault}")
        sys.exit(0 if asked.advisory else 1)
    known = list(findings(packages))
    print("\n".join([*known, f"audit: {len(packages)} packages checked, {len(known)} weaknesses known"]))
    sys.exit(1 if known and not asked.advisory else 0)


def audited(locks: list[Path], service: str) -> list[dict[str, Any]]:
    """What is known of each locked package. Raises NotAskedError."""
    with TemporaryDirectory() as folder:
        answer = Path(folder) / "answer.json"
        command = [sys.executable, "-m", "pip_audit", "--vulnerability-service=osv", f"--osv-url={service}"]
        command += ["--disable-pip", "--require-hashes", "--progress-spinner=off", f"--timeout={ANSWER_S}"]
        command += ["--format=json", f"--output={answer}", *(f"--requirement={lock}" for lock in locks)]
        try:
            run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=ALL_ANSWERS_S)
        except subprocess.TimeoutExpired:
            raise NotAskedError(f"it took longer than {ALL_ANSWERS_S:g} s") from None
        try:
            packages: list[dict[str, Any]] = json.loads(answer.read_text())["dependencies"]
        except (OSError, ValueError, KeyError):  # pip-audit also exits with 1 where something is known
            raise NotAskedError(run.stderr.strip().rpartition("\n")[2] or f"exit code {run.returncode}") from None
    if unread := [package["name"] for package in packages if "vulns" not in package]:
        raise NotAskedError(f"no answer for {', '.join(unread)}")
    return packages


def findings(packages: list[dict[str, Any]]) -> list[str]:
    """A line for each weakness: the package, its names, what mends it."""
    return [
        f"{package['name']} {package['version']}: {' '.join([weakness['id'], *sorted(weakness['aliases'])])}, "
        f"{'mended in ' + ', '.join(weakness['fix_versions']) if weakness['fix_versions'] else 'not mended yet'}"
        for package in packages
        for weakness in package["vulns"]
    ]


if __name__ == "__main__":
    main()
