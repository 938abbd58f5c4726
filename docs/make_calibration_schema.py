"""Writes docs/calibration.schema.json from gateway/calibration; with --check only tells whether it is up to date."""

from pathlib import Path

from generated import keep_up_to_date

from gateway.calibration.file.schema import schema_text

PAGE = Path(__file__).with_name("calibration.schema.json")


def main() -> None:
    """Write the page, or compare it."""
    keep_up_to_date(PAGE, schema_text(), "gateway/calibration")


if __name__ == "__main__":
    main()
