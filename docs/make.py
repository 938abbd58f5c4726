"""Makes the computed parts of the documents: python docs/make.py [--check] [PAGE...]

Without a page it makes all. With --check it writes nothing and exits with 1 if a page is not up to date. Prose is in
the pages themselves; docs/made.py describes the marks between which a program writes.
"""

import argparse
import json
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Final

import measured
import reference
from made import ROOT, StaleError, filled, keep_up_to_date

PARTS: Final[Mapping[str, Mapping[str, Callable[[], str]]]] = {
    **{f"docs/{page}": parts for page, parts in reference.PARTS.items()},
    "README.md": {"kilograms": measured.kilograms},
    "docs/accuracy.md": measured.ACCURACY,
    "docs/faults.md": {
        "faults": measured.faults,
        "figures": measured.fault_figures,
        "days": measured.soak_days,
        "endured": measured.endured,
    },
    "docs/fleet.md": {"fleet test": measured.fleet_test},
    "docs/performance.md": {"conditions": measured.conditions, "speeds": measured.speeds},
}
"""Pages by their place, and each part between its marks."""

WHOLE: Final[Mapping[str, Callable[[], str]]] = {
    "docs/calibration.schema.json": reference.schema_text,
}
"""Files that one function writes."""


def pages() -> list[str]:
    """Every page with computed parts, by its path in the repository."""
    return [*PARTS, *WHOLE]


def text_of(page: str) -> str:
    """The up-to-date text of a page."""
    if page in WHOLE:
        return WHOLE[page]()
    text = filled((ROOT / page).read_text(encoding="utf-8"), PARTS[page])
    return measured.with_samples(text) if page == "README.md" else text


def main() -> None:
    """Write the pages, or compare them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing; end with 1 where a page is not up to date")
    parser.add_argument("--counts", type=Path, help="take what `make fleet-test` counted from this file first")
    parser.add_argument("--record", action="store_true", help="take what the last runs of faults measured first")
    parser.add_argument("page", nargs="*", choices=[[], *pages()], help="such as docs/settings.md; none: all")
    asked = parser.parse_args()
    if asked.counts:
        measured.take(json.loads(asked.counts.read_text(encoding="utf-8")))
    if asked.record:
        measured.record()
    stale = []
    for page in asked.page or pages():
        try:
            keep_up_to_date(ROOT / page, text_of(page), is_check=asked.check)
        except StaleError as fault:
            stale.append(str(fault))
    if stale:
        sys.exit("\n".join(stale))


if __name__ == "__main__":
    main()
