"""What every made page has in common: it is written, or with --check compared with what it should say."""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[1]


def keep_up_to_date(page: Path, text: str, source: str) -> None:
    """Write ``page``; with --check end with a clear line where it does not say what ``source`` does."""
    if "--check" not in sys.argv[1:]:
        page.write_text(text, encoding="utf-8")
    elif not page.is_file() or page.read_text(encoding="utf-8") != text:
        sys.exit(f"{page.relative_to(ROOT)} does not say what {source} does: run `make docs`")
