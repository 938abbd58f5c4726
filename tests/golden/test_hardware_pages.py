"""docs/feed.md and phone.md say what was measured and what the commands print."""

import make_hardware
import make_phone


def test_the_tables_are_those_of_the_numbers() -> None:
    feed = make_hardware.DOCS / "feed.md"
    assert make_hardware.filled(feed, "cost", make_hardware.cost()) == feed.read_text()


def test_the_page_shows_what_import_prints() -> None:
    shown = make_phone.OUTPUT.search(make_phone.PAGE.read_text(encoding="utf-8"))
    assert shown is not None
    assert [line.split()[0] for line in shown[0].splitlines()[2:-2]] == [
        line.split()[0] for line in make_phone.printed().splitlines()
    ]
