"""The cost of the feeders (docs/feed.md, kuksa.md, traccar.md), from measurements.

`python -m benchmarks.speed.feed --output docs/feed_cost.json` and `python -m benchmarks.speed.feeders --output
docs/feeders_cost.json` make them.
"""

import json
from pathlib import Path
from typing import Final

DOCS: Final = Path(__file__).parent


def cost() -> str:
    """The feed's share of one core."""
    told = json.loads((DOCS / "feed_cost.json").read_text(encoding="utf-8"))
    return (
        f"{told['cpu_pct']:.1f} % of one core and {told['rss_mb']:.0f} MB at {told['rate_hz']:.0f} samples a second, "
        f"{told['frames_per_s']:.0f} frames a second ({told['machine']}; `python -m benchmarks.speed.feed`). A "
        f"phone's recording of {told['import']['drive_s'] / 60:.0f} minutes is imported in "
        f"{told['import']['cpu_s']:.1f} s of one core with {told['import']['rss_mb']:.0f} MB.\n"
    )


def told() -> str:
    """The output of the feed in that measurement."""
    found = json.loads((DOCS / "feed_cost.json").read_text(encoding="utf-8"))
    return f"```json\n{json.dumps(found['told'], separators=(',', ':'))}\n```\n"


def kuksa() -> str:
    """The KUKSA feeder's share of one core."""
    return _beside("kuksa", "publishing what is new")


def traccar() -> str:
    """The Traccar feeder's share of one core."""
    return _beside("traccar", "sending what is new")


def _beside(name: str, doing: str) -> str:
    told = json.loads((DOCS / "feeders_cost.json").read_text(encoding="utf-8"))
    one = told[name]
    return (
        f"**What it costs:** {one['rss_mb']:.0f} MB, and {one['cpu_ms_each']:.1f} ms of one core for asking once and "
        f"{doing}. Asking every {one['every_s']:.0f} s, as it does unless told otherwise, that is at most "
        f"{one['cpu_pct']:.2f} % of a core ({told['machine']}; `python -m benchmarks.speed.feeders`).\n"
    )
