"""Fills the measured tables of docs/hardware.md and docs/feed.md from disturbances.json and feed_cost.json.

feed_cost.json comes from `python -m benchmarks.speed.feed --output docs/feed_cost.json`. --check compares.
"""

import json
import re
from pathlib import Path
from typing import Any, Final

from generated import keep_up_to_date

DOCS: Final = Path(__file__).parent
SHOWN: Final = (
    "as recorded",
    "jitter of 3 ms",
    "heaps every 40 ms",
    "2 % of frames lost",
    "gyro late by 20 ms",
    "accelerometer's gain + 2 %",
    "sensor moved 0.2 m back",
    "sensor turned by 10 degrees",
    "no roll rate",
    "load sideways, no roll rate",
)


def filled(page: Path, mark: str, text: str) -> str:
    """The page with what stands between two comments replaced."""
    between = re.compile(rf"(<!-- {mark}: .*?-->\n).*?(<!-- end of {mark} -->)", re.DOTALL)
    return between.sub(lambda found: f"{found[1]}{text}{found[2]}", page.read_text(encoding="utf-8"))


def disturbances() -> str:
    """The lines that a choice of hardware decides."""
    lines = json.loads((DOCS / "disturbances.json").read_text(encoding="utf-8"))["lines"]
    by_name = {line["kind"]: line for line in lines}
    rows = [_row(name, by_name[name]) for name in SHOWN]
    head = "| | batches | refused | payload, mean error | front share, mean error |\n|---|---|---|---|---|\n"
    return head + "".join(f"{row}\n" for row in rows)


def _row(name: str, line: dict[str, Any]) -> str:
    def percent(quantity: str) -> str:
        error = line[f"{quantity}_mean_abs_pct"]
        return "–" if error is None else f"{error:.1f} %"

    return f"| {name} | {line['n_batches']} | {line['n_rejected']} | {percent('payload')} | {percent('front_share')} |"


def cost() -> str:
    """What the feed takes of one core, as it was measured."""
    told = json.loads((DOCS / "feed_cost.json").read_text(encoding="utf-8"))
    return (
        f"{told['cpu_pct']:.1f} % of one core and {told['rss_mb']:.0f} MB at {told['rate_hz']:.0f} samples a second, "
        f"{told['frames_per_s']:.0f} frames a second ({told['machine']}; `python -m benchmarks.speed.feed`). A "
        f"phone's recording of {told['import']['drive_s'] / 60:.0f} minutes is imported in "
        f"{told['import']['seconds']:.1f} s with {told['import']['rss_mb']:.0f} MB.\n"
    )


def main() -> None:
    hardware, feed = DOCS / "hardware.md", DOCS / "feed.md"
    keep_up_to_date(hardware, filled(hardware, "disturbances", disturbances()), "docs/disturbances.json")
    keep_up_to_date(feed, filled(feed, "cost", cost()), "docs/feed_cost.json")


if __name__ == "__main__":
    main()
