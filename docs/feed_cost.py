"""What the feed costs (docs/feed.md), measured by `python -m benchmarks.speed.feed --output docs/feed_cost.json`."""

import json
from pathlib import Path
from typing import Final

DOCS: Final = Path(__file__).parent


def cost() -> str:
    """What the feed takes of one core, as it was measured."""
    told = json.loads((DOCS / "feed_cost.json").read_text(encoding="utf-8"))
    return (
        f"{told['cpu_pct']:.1f} % of one core and {told['rss_mb']:.0f} MB at {told['rate_hz']:.0f} samples a second, "
        f"{told['frames_per_s']:.0f} frames a second ({told['machine']}; `python -m benchmarks.speed.feed`). A "
        f"phone's recording of {told['import']['drive_s'] / 60:.0f} minutes is imported in "
        f"{told['import']['seconds']:.1f} s with {told['import']['rss_mb']:.0f} MB.\n"
    )
