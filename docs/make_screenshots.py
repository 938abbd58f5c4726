"""Writes the pictures of the dashboard, the cab page and the calibration report in docs/images (`make screenshots`).

Runs `springscale demo` as anybody would, opens its dashboard in Debian's chromium through playwright, and takes
the pictures on the second drive, when a loaded batch has been weighed and the next is under way. The tutorial's own
pictures come from its commands: the report of its calibration, and the dashboard after the demonstration's first drive.

Names of pictures, such as `python docs/make_screenshots.py dashboard tutorial`, take these alone.
"""

import json
import shutil
import subprocess
import sys
import time
import urllib.request
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from PIL import Image
from playwright.sync_api import Browser, Page, sync_playwright

IMAGES: Final = Path(__file__).with_name("images")
SPRINGSCALE: Final = (sys.executable, "-m", "gateway")
N_FIRST_DRIVE: Final = 5  # batches of the demonstration's first drive
N_WEIGHED: Final = 9  # the first drive's five batches, the second's three empty ones and its first loaded one
PATIENCE_S: Final = 300.0  # chosen: timeout
MOST_BYTES: Final = 300_000  # chosen: of a picture
GAP_PX: Final = 24  # chosen
LAPTOP: Final[dict[str, Any]] = {"viewport": {"width": 1600, "height": 1000}, "color_scheme": "light"}
REPORT: Final[dict[str, Any]] = {"viewport": {"width": 1240, "height": 1075}, "color_scheme": "light"}
PHONE: Final[dict[str, Any]] = {
    "viewport": {"width": 390, "height": 844},
    "device_scale_factor": 2,
    "is_mobile": True,
    "has_touch": True,
    "color_scheme": "dark",
}


@contextmanager
def demonstration(speed: str, *more: str) -> Iterator[str]:
    """The address of a running demonstration's page."""
    command = [*SPRINGSCALE, "demo", "--port", "0", "--speed", speed, *more]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as running:
        try:
            assert running.stdout is not None
            yield running.stdout.readline().split()[1]
        finally:
            running.terminate()


def wait_for_batches(url: str, are_there: Callable[[list[dict[str, Any]]], bool]) -> None:
    """Wait until the history has the expected batches."""
    end_s = time.monotonic() + PATIENCE_S
    while time.monotonic() < end_s:
        with urllib.request.urlopen(f"{url}/api/v1/estimates?spectra=false") as answer:
            items = json.load(answer)["items"]
        if items and are_there(items):
            return
        time.sleep(0.5)
    sys.exit(f"the demonstration did not weigh what the picture needs in {PATIENCE_S:g} s")


def weighed(n: int) -> Callable[[list[dict[str, Any]]], bool]:
    """So many batches are weighed, the newest among them."""
    return lambda items: sum(not item["rejected"] for item in items) >= n and not items[-1]["rejected"]


def opened(browser: Browser, url: str, options: dict[str, Any], chart: str = "#payload-chart") -> Page:
    """A page with one of its charts drawn."""
    page = browser.new_page(locale="en-GB", timezone_id="UTC", **options)
    page.goto(url)
    page.wait_for_selector(f"{chart}[data-drawn]", timeout=PATIENCE_S * 1000.0)
    return page


def down_to(page: Page, last: str) -> Any:
    """The page from its top to the end of one of its sections, in pixels."""
    bottom_px = page.evaluate(f"document.querySelector('{last}').getBoundingClientRect().bottom + scrollY")
    return {"x": 0, "y": 0, "width": LAPTOP["viewport"]["width"], "height": bottom_px + 12}


def save(picture: bytes, name: str) -> None:
    """Save a PNG of 256 colours, which suffices for charts and text."""
    with Image.open(BytesIO(picture)) as whole:
        whole.convert("RGB").quantize(256).save(IMAGES / name, optimize=True)
    if (IMAGES / name).stat().st_size > MOST_BYTES:
        sys.exit(f"{name} is larger than {MOST_BYTES / 1000:g} kB")


def take_dashboard(browser: Browser) -> None:
    """README's pictures and those of dashboard.md."""
    with demonstration("20") as url:
        wait_for_batches(url, weighed(1))  # before the first there is nothing to draw
        laptop, phone = opened(browser, url, LAPTOP), opened(browser, url, PHONE)
        wait_for_batches(url, weighed(N_WEIGHED))
        laptop.wait_for_timeout(2000)
        save(laptop.screenshot(full_page=True, clip=down_to(laptop, "#history")), "dashboard-laptop.png")
        save(phone.screenshot(), "dashboard-phone.png")


def take_cab(browser: Browser) -> None:
    """cab.md's picture: on the second drive, by night while it is empty, by day with a load that is too heavy."""
    with demonstration("20") as url:
        wait_for_batches(url, weighed(1))
        taken = []
        for scheme, light in (("dark", "go"), ("light", "over")):
            page = browser.new_page(locale="en-GB", timezone_id="UTC", **PHONE | {"color_scheme": scheme})
            page.goto(f"{url}/cab")
            page.wait_for_selector(f"#main[data-is=current][data-light={light}]", timeout=PATIENCE_S * 1000.0)
            taken.append(page.screenshot())
        save(beside(*taken), "cab.png")


def take_fleet(browser: Browser) -> None:
    """fleet.md's picture: five vans after their first drives."""
    with demonstration("1", "--fleet", "5") as url:
        page = browser.new_page(locale="en-GB", timezone_id="UTC", viewport={"width": 1240, "height": 545})
        page.goto(url)
        page.wait_for_selector("#vehicles tr:nth-child(5) .bar", timeout=PATIENCE_S * 1000.0)
        save(page.screenshot(), "fleet.png")


def beside(*pictures: bytes) -> bytes:
    """As one picture, from left to right."""
    images = [Image.open(BytesIO(picture)) for picture in pictures]
    whole = Image.new("RGB", (sum(one.width for one in images) + GAP_PX * (len(images) - 1), images[0].height), "grey")
    left = 0
    for one in images:
        whole.paste(one, (left, 0))
        left += one.width + GAP_PX
    kept = BytesIO()
    whole.save(kept, "PNG")
    return kept.getvalue()


def take_tutorial(browser: Browser) -> None:
    """The dashboard as the tutorial's reader meets it."""
    with demonstration("1") as url:
        wait_for_batches(url, weighed(1))
        page = opened(browser, url, LAPTOP)
        wait_for_batches(url, lambda items: len(items) == N_FIRST_DRIVE)
        page.wait_for_timeout(5000)
        save(page.screenshot(full_page=True, clip=down_to(page, "#history")), "tutorial-dashboard.png")


def take_report(browser: Browser) -> None:
    """The first screens of the tutorial's calibration report."""
    with TemporaryDirectory() as folder:
        bench, report = Path(folder) / "bench", Path(folder) / "report"
        for command in (
            ["simulate", "campaign", "experiment", bench],
            ["calibrate", bench / "campaign.toml", "--output", f"{folder}/vehicle.json", "--report", report],
        ):
            subprocess.run([*SPRINGSCALE, *command], stdout=subprocess.DEVNULL, check=True)
        page = browser.new_page(locale="en-GB", **REPORT)
        page.goto((report / "report.html").as_uri())
        page.wait_for_timeout(2000)
        save(page.screenshot(), "calibration-report.png")


TAKEN: Final = {
    "dashboard": take_dashboard,
    "cab": take_cab,
    "fleet": take_fleet,
    "tutorial": take_tutorial,
    "report": take_report,
}


def main() -> None:
    """Take the pictures."""
    IMAGES.mkdir(exist_ok=True)
    chromium = shutil.which("chromium") or shutil.which("chromium-browser")
    with sync_playwright() as running:
        browser = running.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        for name in sys.argv[1:] or TAKEN:
            TAKEN[name](browser)
        browser.close()


if __name__ == "__main__":
    main()
