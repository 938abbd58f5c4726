"""Fills the measured cost in docs/feed.md from feed_cost.json.

That comes from `python -m benchmarks.speed.feed --output docs/feed_cost.json`. --check compares.
"""

import json
import re
from pathlib import Path
from typing import Final

from generated import keep_up_to_date

DOCS: Final = Path(__file__).parent


def filled(page: Path, mark: str, text: str) -> str:
    """The page with what stands between two comments replaced."""
    between = re.compile(rf"(<!-- {mark}: .*?-->\n).*?(<!-- end of {mark} -->)", re.DOTALL)
    return between.sub(lambda found: f"{found[1]}{text}{found[2]}", page.read_text(encoding="utf-8"))


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
    feed = DOCS / "feed.md"
    keep_up_to_date(feed, filled(feed, "cost", cost()), "docs/feed_cost.json")


if __name__ == "__main__":
    main()
