"""In continuous integration nothing that was promised may be left out: such a skip fails the run."""

import os

import pytest

PROMISED = ("chromium", "playwright", "mosquitto", "a test machine", "recorded drives")  # the last beside the checkout


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
