"""The documents make a site without a warning, and reading it asks nobody else."""

import re
import subprocess
import sys
from pathlib import Path

import make_site
import pytest
from support.patience import PATIENCE_S

LOADED = re.compile(r"""<(?:script|img|iframe|source|object|embed)[^>]*?(?:src|data)=["']?([^"' >]+)""")
LINKED = re.compile(r"<link[^>]*?href=[\"']?([^\"' >]+)")
FETCHED = re.compile(r"(?:@import|url\()\s*[\"']?([^\"')]+)")


MOST_PAGES = 35  # chosen: what a reader of the navigation takes in; a page more is a page merged


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, make_site.__file__, str(folder)]
    built = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert (built.returncode, built.stderr) == (0, "")
    return folder


def test_every_page_is_built(site: Path) -> None:
    pages = [page.relative_to(make_site.DOCS).with_suffix(".html") for page in make_site.DOCS.rglob("*.md")]
    assert [page for page in pages if not (site / page).is_file()] == []
    assert (site / "index.html").is_file()


def test_every_page_belongs_to_one_of_four_sections() -> None:
    nav = (make_site.ROOT / "mkdocs.yml").read_text(encoding="utf-8").partition("\nnav:\n")[2]
    assert re.findall(r"^  - ([^:\n]+):$", nav, re.MULTILINE) == ["Start", "Do", "Look up", "Understand"]
    assert len(re.findall(r"^ +- [^:\n]+: [\w-]+\.md$", nav, re.MULTILINE)) <= MOST_PAGES


def test_a_link_to_a_missing_heading_fails_the_build(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    gather = make_site.gather

    def with_a_dead_link() -> None:
        gather()
        (make_site.PAGES / "errors.md").write_text("[gone](index.md#no-such-heading)")

    monkeypatch.setattr(make_site, "gather", with_a_dead_link)
    monkeypatch.setattr(sys, "argv", ["make_site.py", str(tmp_path)])
    with pytest.raises(SystemExit) as end:
        make_site.main()
    assert end.value.code == 1
    assert "no-such-heading" in capfd.readouterr().err


def test_nothing_is_loaded_from_elsewhere(site: Path) -> None:
    named = [
        (file.name, found)
        for pattern, suffix in ((LOADED, "html"), (LINKED, "html"), (FETCHED, "html"), (FETCHED, "css"))
        for file in site.rglob(f"*.{suffix}")
        for found in pattern.findall(file.read_text(encoding="utf-8"))
    ]
    assert len(named) > 100
    assert [each for each in named if re.match(r"(https?:)?//", each[1])] == []


def test_links_to_what_is_no_page_keep_their_words(tmp_path: Path) -> None:
    places = {tmp_path / "a.md": Path("index.md"), tmp_path / "docs/b.md": Path("b.md")}
    (tmp_path / "a.md").write_text("[b](docs/b.md#c), [`a [test]`](tests/x.py), [web](https://example.org), [a](#d)")
    said = "[b](b.md#c), `a [test]`, [web](https://example.org), [a](#d)"
    assert make_site.fitted(tmp_path / "a.md", places) == said


def test_every_formula_is_one_that_a_browser_shows(site: Path) -> None:
    for page in ("method.html", "campaign.html"):
        text = (site / page).read_text(encoding="utf-8")
        assert text.count("<math") > 10
        assert re.findall(r"\$[^<\n]*\\[a-z]+", text) == []


def test_dollar_signs_in_code_are_no_formulas() -> None:
    code = "```console\n$ springscale run $HOME\n```\n\n    echo $A $B\n\n`$A` and `$B`\n"
    assert make_site.with_formulas(code) == code
    assert "<math" in make_site.with_formulas("a $x_f$ b")
