"""What the documents point at inside the project is there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [*ROOT.glob("*.md"), *ROOT.glob("docs/**/*.md"), *ROOT.glob("deploy/**/*.md"), *ROOT.glob("benchmarks/**/*.md")]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_relative_link_leads_somewhere(page: Path) -> None:
    links = re.findall(r"\]\(([^)#\s]+)", page.read_text(encoding="utf-8"))
    missing = [link for link in links if "://" not in link and not (page.parent / link).exists()]
    assert not missing


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_every_link_to_a_heading_finds_it(page: Path) -> None:
    links = [link.partition("#") for link in re.findall(r"\]\(([^)\s]*#[^)\s]+)", page.read_text(encoding="utf-8"))]
    places = [(page.parent / name if name else page, heading) for name, _, heading in links if "://" not in name]
    assert [each for each in places if each[0].suffix == ".md" and each[1] not in headings(each[0])] == []


def headings(page: Path) -> set[str]:
    """Of a page, as links name them: small letters, no signs, hyphens for blanks."""
    text = re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.DOTALL)
    words = (
        re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", found) for found in re.findall(r"^#+ +(.*?) *$", text, re.MULTILINE)
    )
    return {re.sub(r"[^\w\- ]", "", each.lower()).replace(" ", "-") for each in words}
