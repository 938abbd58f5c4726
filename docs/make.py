"""Makes the computed parts of the documents: python docs/make.py [--check] [PAGE...]

Without a page it makes all. With --check it writes nothing and exits with 1 if a page is not up to date. Prose is in
the pages themselves; the text between <!-- made: NAME --> and <!-- end: NAME --> comes from the code, a measurement or
a command.
"""

import argparse
import json
import sys
import tomllib
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

import drawn
import errors_table
import faults
import feed_cost
import fleet_counts
import performance
import printed
import reference
import scale
import studies
from made import ROOT, StaleError, filled, keep_up_to_date

DOCS: Final = ROOT / "docs"
PARTS: Final[Mapping[str, Mapping[str, Callable[[], str]]]] = {
    **{f"docs/{page}": parts for page, parts in reference.PARTS.items()},
    "docs/contribute.md": {"packed": printed.campaign_pack},
    "docs/feed.md": {"cost": feed_cost.cost, "told": feed_cost.told},
    "docs/fleet.md": {"fleet test": fleet_counts.counted},
    "docs/hardware.md": {"noise": studies.noise_that_works},
    "docs/kuksa.md": {"cost": feed_cost.kuksa},
    "docs/phone.md": {"output": printed.phone_import, "accuracy": studies.phone_beside_can},
    "docs/traccar.md": {"cost": feed_cost.traccar},
}
"""Pages with words of their own, by their place; each part between its marks."""

TOLERANCES: Final = {"docs/phone.md": 0.01}


def _json(name: str) -> Any:
    return json.loads((DOCS / name).read_text(encoding="utf-8"))


def _readme() -> str:
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    return errors_table.with_samples(filled(text, {"errors": errors_table.table}))


def _scale() -> str:
    return scale.scale_page(scale.measured_figures(), tomllib.loads((DOCS / "scale.toml").read_text(encoding="utf-8")))


WHOLE: Final[Mapping[str, Callable[[], str]]] = {
    "README.md": _readme,
    "docs/calibration.schema.json": reference.schema_text,
    "docs/errors.md": errors_table.errors_page,
    "docs/faults.md": faults.faults_page,
    "docs/performance.md": lambda: performance.performance_page(_json("performance.json")),
    "docs/scale.md": _scale,
    **{f"docs/images/{name}": draw for name, draw in drawn.DRAWINGS.items()},
}
"""Pages that one function writes."""


def pages() -> list[str]:
    """Every page with computed parts, by its path in the repository."""
    return [*PARTS, *WHOLE]


def text_of(page: str) -> str:
    """The up-to-date text of a page."""
    if page in WHOLE:
        return WHOLE[page]()
    return filled((ROOT / page).read_text(encoding="utf-8"), PARTS[page])


def tolerance_of(page: str) -> float:
    """Permitted difference of a number between machines."""
    return drawn.TOLERANCE_PX if page.endswith(".svg") else TOLERANCES.get(page, 0.0)


def main() -> None:
    """Write the pages, or compare them."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--check", action="store_true", help="write nothing; end with 1 where a page is not up to date")
    parser.add_argument("--counts", type=Path, help="take what `make fleet-test` counted from this file first")
    parser.add_argument("--record", action="store_true", help="take what the last runs of faults measured first")
    parser.add_argument("page", nargs="*", choices=[[], *pages()], help="such as docs/settings.md; none: all")
    asked = parser.parse_args()
    if asked.counts:
        fleet_counts.take(json.loads(asked.counts.read_text(encoding="utf-8")))
    if asked.record:
        faults.record()
    stale = []
    for page in asked.page or pages():
        try:
            keep_up_to_date(ROOT / page, text_of(page), is_check=asked.check, tolerance=tolerance_of(page))
        except StaleError as fault:
            stale.append(str(fault))
    if stale:
        sys.exit("\n".join(stale))


if __name__ == "__main__":
    main()
