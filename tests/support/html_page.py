"""A made page as its reader finds it."""

import re
from html.parser import HTMLParser
from pathlib import Path

VOID = {"meta", "img", "br", "link", "input", "hr"}


class Page(HTMLParser):
    """The ids, links, pictures, tables and headings of a page; checks that elements are closed in order."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []
        self.fetched: list[str] = []
        self.links: list[str] = []
        self.alts: list[str] = []
        self.tables: list[list[list[str]]] = []
        self.headings: list[int] = []
        self.cell: list[str] | None = None
        self.feed(text)
        self.close()

    def handle_starttag(self, tag: str, attributes: list[tuple[str, str | None]]) -> None:
        found = dict(attributes)
        self.ids += [found["id"] or ""] if "id" in found else []
        self.fetched += [found["src"] or ""] if "src" in found else []
        self.links += [found["href"] or ""] if "href" in found else []
        self.alts += [found.get("alt") or ""] if tag == "img" else []
        self.headings += [int(tag[1])] if re.fullmatch("h[1-6]", tag) else []
        if tag == "table":
            self.tables.append([])
        elif tag == "tr":
            self.tables[-1].append([])
        elif tag in ("td", "th"):
            self.cell = []
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag
        if tag in ("td", "th") and self.cell is not None:
            self.tables[-1][-1].append("".join(self.cell).replace("\u00a0", " "))
            self.cell = None

    def handle_data(self, text: str) -> None:
        if self.cell is not None:
            self.cell.append(text)


def assert_well_formed(page: Page) -> None:
    """Every element is closed, ids are unique, headings descend by one, rows have as many cells as their heads."""
    assert page.open == []
    assert len(page.ids) == len(set(page.ids))
    assert page.headings[0] == 1
    assert all(later <= sooner + 1 for sooner, later in zip(page.headings, page.headings[1:], strict=False))
    assert all(len(row) == len(table[0]) for table in page.tables for row in table)


def assert_self_contained(path: Path) -> None:
    """All that the page in this file fetches or links to lies beside it."""
    text = path.read_text(encoding="utf-8")
    page = Page(text)
    for source in [*page.fetched, *(link for link in page.links if not link.startswith("#"))]:
        assert not re.match(r"[a-z]+:|//", source)
        assert (path.parent / source).stat().st_size > 1000
    assert not re.search(r"https?://|url\(|@import|<link", text)
