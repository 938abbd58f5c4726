"""Playwright's ``expect``; a module that imports it is skipped where playwright is not installed."""

import pytest

playwright = pytest.importorskip("playwright.sync_api", reason="needs playwright (dependency group browser)")
expect = playwright.expect
