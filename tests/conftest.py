"""No test depends on the machine's speed; what continuous integration promised and left out fails the run."""

import logging
import os
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, settings

from gateway.log import LOGGER
from gateway.model.allocator import keep_freed_memory

# The last lie beside the checkout
PROMISED = ("chromium", "playwright", "mosquitto", "postgresql", "a test machine", "recorded drives")

# Files of more than about ten seconds, the longest first: two workers that take whole files then end together.
LONGEST_FIRST = (
    "golden/test_recorded_roll.py",
    "golden/test_tutorial.py",
    "golden/test_recorded_drives.py",
    "e2e/test_reproduce.py",
    "e2e/test_web_dashboard.py",
    "scenarios/test_web_memory.py",
    "e2e/test_calibration_report.py",
    "e2e/test_web_cab_page.py",
    "e2e/test_dist.py",
    "e2e/test_vehicle_packages.py",
    "e2e/test_web_dashboard_live.py",
    "e2e/test_cli_demo.py",
    "golden/test_wrong_labels.py",
    "e2e/test_gateway_service.py",
    "contracts/test_web_description.py",
    "golden/test_recorded_sensor_faults.py",
    "scenarios/test_fleet_view.py",
    "unit/test_inspection_campaign.py",
    "scenarios/test_calibrate_options.py",
    "scenarios/test_bad_campaigns.py",
    "e2e/test_archive_cluster.py",
)

keep_freed_memory()  # as the command does
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")


def pytest_configure(config: pytest.Config) -> None:
    """Files go out in the order of pytest_collection_modifyitems: by itself, xdist begins with the most tests."""
    config.option.loadscopereorder = False


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files first, the others as they come."""
    places = {name: place for place, name in enumerate(LONGEST_FIRST)}
    items.sort(key=lambda item: places.get("/".join(item.path.parts[-2:]), len(places)))


@pytest.fixture(scope="session", autouse=True)
def _kept(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """One folder for all processes of a run: see support.kept."""
    from support.kept import PLACE

    folder = tmp_path_factory.getbasetemp()
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv(PLACE, str((folder.parent if "PYTEST_XDIST_WORKER" in os.environ else folder) / "kept"))
        yield


@pytest.fixture(scope="session", autouse=True)
def _unhurried() -> Iterator[None]:
    """Parts of the service wait for one another as long as tests do."""
    from support.unhurried import unhurry

    with pytest.MonkeyPatch.context() as patch:
        unhurry(patch)
        yield


@pytest.fixture(autouse=True)
def _log_as_before() -> Iterator[None]:
    """A command that sets up the log leaves no handler that writes to a stream closed since."""
    root = logging.getLogger()
    before = root.handlers[:], root.level, LOGGER.level
    yield
    root.handlers[:], level, ours = before
    root.setLevel(level)
    LOGGER.setLevel(ours)


def pytest_sessionfinish(session: pytest.Session) -> None:
    """Fail where CI=true and a test was skipped for want of something that .ci/run provides."""
    reporter = session.config.pluginmanager.get_plugin("terminalreporter")
    if os.environ.get("CI") != "true" or reporter is None:
        return
    reasons = [str(report.longrepr) for report in reporter.stats.get("skipped", ())]
    wanting = [reason for reason in reasons if any(word in reason for word in PROMISED)]
    if wanting:
        reporter.write_line("\nskipped, though .ci/run should provide for it:\n" + "\n".join(wanting), red=True)
        session.exitstatus = pytest.ExitCode.TESTS_FAILED
