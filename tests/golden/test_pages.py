"""Pages list what the code has: settings, reasons, refusals, findings, fault tests. Links lead somewhere."""

import ast
import json
import re
import tomllib
from pathlib import Path

import measured
import pytest

from gateway.calibration.inspection.finding import Finding, Kind, Severity
from gateway.config import BatchSection, Settings
from gateway.records import Why

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PAGES = [
    *ROOT.glob("*.md"),
    *(page for name in ("docs", "deploy", "benchmarks") for page in ROOT.glob(f"{name}/**/*.md")),
]
of_each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))


def text_of(page: str) -> str:
    return (DOCS / page).read_text(encoding="utf-8")


def test_every_setting_is_described() -> None:
    for name, field in Settings.model_fields.items():
        keys = getattr(field.annotation, "model_fields", None)
        described = {f"{name}.{key}": inner for key, inner in keys.items()} if keys else {name: field}
        assert [key for key, inner in described.items() if not inner.description] == []


@pytest.mark.parametrize("room", sorted(path.parent for path in (ROOT / "gateway").rglob("__init__.py")), ids=str)
def test_every_package_has_a_docstring(room: Path) -> None:
    said = ast.get_docstring(ast.parse((room / "__init__.py").read_text(encoding="utf-8")))
    assert said
    assert "TODO" not in said


def test_every_compared_program_is_on_the_performance_page() -> None:
    found = json.loads(text_of("performance.json"))
    parts = {"decode", "formats", "day", "live", "service", "web", "weigh", "archive", "start", "simulator"}
    assert parts <= set(found)
    assert not [name for name, row in found["decode"]["rows"].items() if "skipped" in row]


@of_each_page
def test_every_relative_link_has_a_target(page: Path) -> None:
    links = re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8"))
    missing = [link for link in links if "://" not in link and not (page.parent / link).exists()]
    assert not missing


@of_each_page
def test_every_link_to_a_heading_finds_it(page: Path) -> None:
    links = [link.partition("#") for link in re.findall(r"\]\(([^)\s]*#[^)\s]+)", page.read_text(encoding="utf-8"))]
    places = [(page.parent / name if name else page, heading) for name, _, heading in links if "://" not in name]
    assert [each for each in places if each[0].suffix == ".md" and each[1] not in headings(each[0])] == []


def headings(page: Path) -> set[str]:
    """The headings of a page as links name them: small letters, no signs, hyphens for blanks."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    words = (
        re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", found) for found in re.findall(r"^#+ +(.*?) *$", text, re.MULTILINE)
    )
    return {re.sub(r"[^\w\- ]", "", each.lower()).replace(" ", "-") for each in words}


REASONS = [
    line.split("|")
    for line in text_of("reasons.md").partition("## Why an estimate is uncertain")[0].splitlines()
    if line.startswith("| `")
]


def test_every_reason_is_explained_once_and_says_what_to_do() -> None:
    assert sorted(reason for row in REASONS for reason in re.findall(r"`(\w+)`", row[1])) == sorted(Why)
    assert [row[1] for row in REASONS if not (row[2].strip() and row[3].strip())] == []


def test_every_limit_of_a_reason_is_a_setting() -> None:
    others = {"cross_spectrum", "ratio_index", "valid_when", "wheel_speed", "pitch_rate"}
    limits = {name for row in REASONS for name in re.findall(r"`(\w+_\w+)`", row[2] + row[3])} - others
    assert limits <= set(BatchSection.model_fields)


def test_every_finding_is_explained_once_as_the_code_has_it_and_found_somewhere_in_the_code() -> None:
    rows = [
        re.split(r" *\| *", line)[1:4]
        for line in text_of("reasons.md").partition("## Findings of the inspection")[2].splitlines()
        if line.startswith("| `")
    ]
    told = {name.strip("`"): weight for name, weight, _ in rows}
    assert all(means for *_, means in rows)
    assert len(told) == len(rows)
    assert told == {str(kind): " or ".join(kind.severities) for kind in Kind}
    room = ROOT / "gateway/calibration/inspection"
    sources = [*room.glob("*.py"), room.parent / "from_drives.py"]
    code = "".join(path.read_text(encoding="utf-8") for path in sources)
    assert [kind for kind in Kind if not re.search(rf"Kind\.{kind.name}\b", code)] == []


def test_a_finding_has_no_other_weight_than_the_page_says() -> None:
    with pytest.raises(ValueError, match="smooth_road is never a fault"):
        Finding.of(Kind.SMOOTH_ROAD, "", Severity.FAULT)


def test_every_fault_names_a_test_that_exists_and_every_fault_test_of_the_machine_has_a_row() -> None:
    named = {row["test"] for row in tomllib.loads((ROOT / "tests" / "faults.toml").read_text())["row"]}
    for file, _, name in (each.partition("::") for each in named):
        assert f"\ndef {name}(" in (ROOT / file).read_text(encoding="utf-8"), (file, name)
    found = {
        f"tests/vm/{file.name}::{name}"
        for file in (ROOT / "tests" / "vm").glob("test_[3-7]_*.py")
        for name in re.findall(r"^def (test_\w+)", file.read_text(encoding="utf-8"), re.MULTILINE)
    }
    assert found <= named


def test_every_recorded_run_and_every_test_of_make_soak_still_has_its_name() -> None:
    there = {
        name
        for file in (ROOT / "tests" / "vm").glob("test_*.py")
        for name in re.findall(r"^def (test_\w+)", file.read_text(encoding="utf-8"), re.MULTILINE)
    }
    recorded = {
        test.partition("[")[0]
        for file in measured.RECORDED.values()
        for test in measured.numbers(file).get("tests", {})
    }
    soaked = set(re.findall(r"::(test_\w+)", (ROOT / "Makefile").read_text(encoding="utf-8")))
    assert recorded | soaked | {name for name, *_ in measured.ENDURED} <= there
    assert soaked


FLEETS = json.loads(measured.COUNTS.read_text(encoding="utf-8"))


def test_in_no_counted_fleet_was_anything_lost_or_doubled() -> None:
    for counts in FLEETS:
        assert counts["vehicles"] >= 50
        assert counts["estimate_rows"] == counts["estimates"] > 0
        assert counts["entry_rows"] == counts["entries"] > 0
        assert (counts["ids_doubled"], counts["records_missing"], counts["unreadable"]) == (0, 0, 0)


def test_a_count_replaces_the_earlier_one_of_as_many_vehicles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measured, "COUNTS", tmp_path / "fleet_test.json")
    measured.COUNTS.write_text(json.dumps(FLEETS[:1]))
    for n, seconds in ((500, 9.0), (FLEETS[0]["vehicles"], 7.0), (500, 8.0)):
        measured.take({**FLEETS[0], "vehicles": n, "seconds": seconds})
    told = [(run["vehicles"], run["seconds"]) for run in json.loads(measured.COUNTS.read_text())]
    assert told == [(FLEETS[0]["vehicles"], 7.0), (500, 8.0)]
