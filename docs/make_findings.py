"""Writes docs/findings.md from the words of every finding; with --check only tells if it is up to date."""

from pathlib import Path

from generated import keep_up_to_date

from gateway.calibration.inspection.explained import EXPLAINED, Topic

PAGE = Path(__file__).with_name("findings.md")

INTRODUCTION = """\
# What inspection finds in a campaign

Generated from `gateway/calibration/inspection/explained.py` by `python docs/make_findings.py`; do not edit by hand.

`springscale calibrate` looks at every drive before it fits anything, and says what it finds and what to do about it
([calibration](calibration.md)). A fault keeps a run out of the calibration, a warning wants a look and goes into the
calibration file, a note is to know. Where two are named, it depends on how bad it is.
"""


def findings_page() -> str:
    """The whole page as Markdown."""
    return "\n".join([INTRODUCTION, *(_table(topic) for topic in Topic)])


def _table(topic: Topic) -> str:
    rows = [
        f"| `{kind}` | {' or '.join(explained.severities)} | {explained.means} | {explained.advice} |"
        for kind, explained in EXPLAINED.items()
        if explained.topic is topic
    ]
    head = "| finding | weight | what it means | what to do |\n|---|---|---|---|"
    return f"## {topic}\n\n{head}\n" + "\n".join(rows) + "\n"


def main() -> None:
    """Write the page, or compare it."""
    keep_up_to_date(PAGE, findings_page(), "gateway/calibration/inspection/explained.py")


if __name__ == "__main__":
    main()
