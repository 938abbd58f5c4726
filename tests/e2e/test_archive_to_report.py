"""An archive of logs becomes the fleet's pages by the commands, and a browser shows them."""

import json
from pathlib import Path
from typing import Any

import pytest
from support.archive import MIDNIGHT_NS, write_drive, write_manifest

from gateway.cli import main

PHONE = {"width": 390, "height": 844}


def called(*arguments: str, ends_with: int) -> None:
    with pytest.raises(SystemExit) as left:
        main(list(arguments))
    assert (left.value.code or 0) == ends_with


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two vehicles, one with a log that nobody can read."""
    folder = tmp_path_factory.mktemp("fleet")
    manifest = write_manifest(folder / "archive", "van-1", "van-2")
    for n, name in enumerate(("van-1", "van-2")):
        write_drive(folder / "archive" / name / "1.log", MIDNIGHT_NS, 61.0, seed=n)
    (folder / "archive/van-2/2.log").write_text("nothing of ours\n")
    dataset, output = str(folder / "dataset"), str(folder / "report")
    called("reprocess", str(manifest), "--output", dataset, "--workers", "1", ends_with=1)
    called("fleet-report", dataset, "--output", output, ends_with=0)
    return folder / "report"


def test_an_archive_becomes_a_report(report: Path) -> None:
    told = json.loads((report / "report.json").read_text())
    assert [vehicle["name"] for vehicle in told["vehicles"]] == ["van-1", "van-2"]
    assert told["n"] == sum(vehicle["n"] for vehicle in told["vehicles"]) >= 6
    [failure] = told["failures"]
    assert (failure["vehicle"], failure["log"]) == ("van-2", "van-2/2.log")
    assert "no CAN frame" in failure["reason"]


@pytest.mark.parametrize("page_of", ["report.html", "vehicles/van-1.html"])
def test_a_phone_without_a_network_shows_every_chart_and_scrolls_one_way(
    report: Path, browser: Any, page_of: str
) -> None:
    page = browser.new_page(viewport=PHONE, offline=True)
    faults: list[str] = []
    page.on("pageerror", lambda fault: faults.append(str(fault)))
    page.on("requestfailed", lambda request: faults.append(request.url))
    page.goto(f"file://{report / page_of}")
    page.wait_for_function("[...document.images].every((one) => one.complete && one.naturalWidth > 0)")
    assert page.evaluate("document.documentElement.scrollWidth") <= PHONE["width"]
    assert faults == []
    page.close()
