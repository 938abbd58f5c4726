"""One machine for the whole run: booted once, the package under test installed in it. Files run in any order."""

import fcntl
import json
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from vm.harness.backend import best_backend
from vm.harness.machine import Machine
from vm.harness.vehicle import Vehicle

BUILD = Path(__file__).parents[2] / "build"
RESULTS = BUILD / os.environ.get("SPRINGSCALE_VM_RESULTS", "vm-results.json")
_BEGUN_S = time.monotonic()
_RECOVERY = pytest.StashKey[float]()
_FINDINGS = pytest.StashKey[dict[str, dict[str, object]]]()


def _package() -> Path:
    """The package under test: what `make deb` left for such a machine, unless SPRINGSCALE_DEB names another."""
    found = list(BUILD.glob("springscale_*_amd64.deb"))
    named = os.environ.get("SPRINGSCALE_DEB")
    if named is None and not found:
        pytest.skip("no package to test: make deb")
    return Path(named) if named else max(found, key=lambda path: path.stat().st_mtime)


@pytest.fixture(scope="session")
def package() -> Path:
    """The .deb under test."""
    return _package()


@pytest.fixture(scope="session")
def machine(tmp_path_factory: pytest.TempPathFactory, request: pytest.FixtureRequest) -> Iterator[Machine]:
    """A booted machine without our package."""
    backend = best_backend()
    if isinstance(backend, str):
        pytest.skip(backend)
    made = Machine(backend, tmp_path_factory.mktemp("machine"))
    try:
        made.boot()
        request.config.stash.setdefault(_FINDINGS, {})["machine"] = {
            "backend": backend.name,
            "kernel": made.run("uname -r").strip(),
            "systemd": made.run("systemctl --version").split("\n")[0],
            "boot_s": round(made.boot_s, 1),
        }
        yield made
    finally:
        made.close()


@pytest.fixture(scope="session")
def box(machine: Machine) -> Vehicle:
    """The machine as a vehicle's box, perhaps without the package."""
    return Vehicle(machine)


@pytest.fixture(scope="module")
def installed(box: Vehicle, package: Path) -> Vehicle:
    """The box with the package, vcan0 and a running service; a test that removed the package ran in any order."""
    if not box.is_installed():
        box.install(package)
        box.wait_until(lambda status: True)
    return box


@pytest.fixture
def vehicle(installed: Vehicle) -> Iterator[Vehicle]:
    """The service as a test finds it: settings as shipped for tests, bus up, nothing playing, running."""
    yield installed
    installed.restore()


@pytest.fixture
def recovered(request: pytest.FixtureRequest) -> Callable[[float], None]:
    """Called with the measured recovery time in seconds: it goes into docs/faults.md."""

    def note(seconds: float) -> None:
        request.node.stash[_RECOVERY] = seconds

    return note


@pytest.fixture
def measured(request: pytest.FixtureRequest) -> Callable[..., None]:
    """Called with figures, name=number: they go into docs/faults.md."""

    def note(**figures: float) -> None:
        request.config.stash.setdefault(_FINDINGS, {}).setdefault("figures", {}).update(figures)

    return note


def pytest_runtest_setup() -> None:
    """SPRINGSCALE_VM_BUDGET_S: no test begins later than this many seconds after the first."""
    budget_s = float(os.environ.get("SPRINGSCALE_VM_BUDGET_S", "inf"))
    if time.monotonic() - _BEGUN_S > budget_s:
        pytest.skip(f"the {budget_s:.0f} s for this run are used up; make test-vm runs all")


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Iterator[None]:
    """Keep each test's outcome and recovery time."""
    outcome = yield
    report = outcome.get_result()  # type: ignore[attr-defined]
    if report.when == "call" and not report.skipped:
        findings = item.config.stash.setdefault(_FINDINGS, {}).setdefault("tests", {})
        findings[item.name] = {"outcome": report.outcome, "recovery_s": item.stash.get(_RECOVERY, None)}


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Add what was found to the results; several workers may do so, one after the other."""
    findings = session.config.stash.get(_FINDINGS, {})
    if not findings:
        return
    BUILD.mkdir(exist_ok=True)
    with RESULTS.open("a+") as file:
        fcntl.flock(file, fcntl.LOCK_EX)
        file.seek(0)
        earlier = json.loads(file.read() or "{}")
        file.truncate(0)
        file.write(json.dumps({key: earlier.get(key, {}) | findings.get(key, {}) for key in {*earlier, *findings}}))


def pytest_terminal_summary(terminalreporter: pytest.TerminalReporter) -> None:
    """Writes the duration of the tests for the log of continuous integration."""
    terminalreporter.write_line(f"the machine's tests took {time.monotonic() - _BEGUN_S:.0f} s")
