"""Writes docs/calibration.schema.json from gateway/calibration; with --check only tells whether it is up to date."""

import sys
from pathlib import Path

from gateway.calibration.file_schema import schema_text

PAGE = Path(__file__).with_name("calibration.schema.json")


def main() -> None:
    """Write the schema, or compare it."""
    if "--check" not in sys.argv[1:]:
        PAGE.write_text(schema_text(), encoding="utf-8")
    elif not PAGE.is_file() or PAGE.read_text(encoding="utf-8") != schema_text():
        sys.exit("docs/calibration.schema.json does not say what gateway/calibration does: run `make docs`")


if __name__ == "__main__":
    main()
