"""Writes the pictures of the dashboard in docs/images (`make screenshots`).

Runs `springscale demo` as anybody would, opens its dashboard in Debian's chromium through playwright, and takes
the pictures on the second drive, when a loaded batch has been weighed and the next is under way.
"""

import json
import shutil
import subprocess
import sys
import time
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

from playwright.sync_api import Browser, Page, sync_playwright

IMAGES: Final = Path(__file__).with_name("images")
N_WEIGHED: Final = 9  # the first drive's five batches, the second's three empty ones and its first loaded one
PATIENCE_S: Final = 300.0
MOST_BYTES: Final = 300_000
LAPTOP: Final[dict[str, Any]] = {"viewport": {"width": 1240, "height": 1075}, "color_scheme": "light"}
PHONE: Final[dict[str, Any]] = {
    "viewport": {"width": 390, "height": 844},
    "device_scale_factor": 2,
    "is_mobile": True,
    "has_touch": True,
    "color_scheme": "dark",
}


@contextmanager
def demonstration() -> Iterator[str]:
    """Where the dashboard of a running demonstration is."""
    command = [sys.executable, "-m", "gateway", "demo", "--port", "0", "--speed", "20"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        try:
            assert running.stdout is not None
            yield running.stdout.readline().split()[1]
        finally:
            running.terminate()


def wait_for_batches(url: str, n_weighed: int) -> None:
    """Until so many batches are weighed, the newest among them."""
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        with urllib.request.urlopen(f"{url}/api/v1/estimates?spectra=false") as answer:
            items = json.load(answer)["items"]
        if items and sum(not item["rejected"] for item in items) >= n_weighed and not items[-1]["rejected"]:
            return
        time.sleep(0.5)
    sys.exit(f"the demonstration did not weigh {n_weighed} batches in {PATIENCE_S:g} s")


def opened(browser: Browser, url: str, options: dict[str, Any]) -> Page:
    """A page with every chart drawn."""
    page = browser.new_page(locale="en-GB", timezone_id="UTC", **options)
    page.goto(url)
    for chart in ("#payload-chart", "#spectra-phase_rad"):
        page.wait_for_selector(f"{chart}[data-drawn]", timeout=PATIENCE_S * 1000.0)
    return page


def down_to(page: Page, last: str) -> Any:
    """The page from its top to the end of one of its sections, in pixels."""
    bottom_px = page.evaluate(f"document.querySelector('{last}').getBoundingClientRect().bottom + scrollY")
    return {"x": 0, "y": 0, "width": LAPTOP["viewport"]["width"], "height": bottom_px + 12}


def main() -> None:
    """Take the pictures."""
    IMAGES.mkdir(exist_ok=True)
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    with demonstration() as url, sync_playwright() as running:
        browser = running.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        wait_for_batches(url, 1)  # before the first there is nothing to draw
        laptop, phone = opened(browser, url, LAPTOP), opened(browser, url, PHONE)
        wait_for_batches(url, N_WEIGHED)
        laptop.wait_for_timeout(2000)
        laptop.screenshot(path=IMAGES / "dashboard-laptop.png", full_page=True, clip=down_to(laptop, "#history"))
        phone.screenshot(path=IMAGES / "dashboard-phone.png")
        laptop.locator("#spectra").screenshot(path=IMAGES / "dashboard-spectra.png")
        browser.close()
    for picture in IMAGES.glob("dashboard-*.png"):
        if picture.stat().st_size > MOST_BYTES:
            sys.exit(f"{picture} is larger than {MOST_BYTES / 1000:g} kB")


if __name__ == "__main__":
    main()
