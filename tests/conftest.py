"""No test depends on the machine's speed; what continuous integration promised and left out fails the run."""

import os
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, settings

from gateway.allocator import keep_freed_memory

# The last lie beside the checkout
PROMISED = ("chromium", "playwright", "mosquitto", "postgresql", "ssh-keygen", "a test machine", "recorded drives")

keep_freed_memory()  # as the command does
settings.register_profile("any machine", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("any machine")


@pytest.fixture(scope="session", autouse=True)
def _unhurried() -> Iterator[None]:
    """Parts of the service wait for one another as long as tests do."""
    from support.unhurried import unhurry

    with pytest.MonkeyPatch.context() as patch:
        unhurry(patch)
        yield


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
