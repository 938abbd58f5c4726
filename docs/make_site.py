"""Builds the documents as a site, `make site`: every page of docs/ and those of the top folder, strictly by mkdocs.

A link in a document is relative to its place in the repository. In the site it becomes relative to the page; a link to
something that is not a page, such as a test, becomes plain text.
"""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

from latex2mathml.converter import convert

ROOT: Final = Path(__file__).parents[1]
DOCS: Final = ROOT / "docs"
PAGES: Final = ROOT / "build/site-pages"  # docs_dir of mkdocs.yml
TOP_PAGES: Final = ("CONTRIBUTING.md",)
STATIC: Final = ("*.md", "*.svg", "*.png", "calibration.schema.json")
LINK: Final = re.compile(r"(?P<mark>!?)\[(?P<words>(?:`[^`]*`|[^\[\]`])*)\]\((?P<target>[^)\s]+)\)")

VERBATIM: Final = re.compile(r"^```.*?^```$|^ {4}.*?$|`[^`\n]+`", re.MULTILINE | re.DOTALL)
FORMULA: Final = re.compile(r"^\$\$(?P<block>.+?)\$\$$|\$(?P<inline>[^$\n]+)\$", re.MULTILINE)


def main() -> None:
    """Gather the pages, then build them: any warning is an error. An argument names another output folder."""
    output = sys.argv[1] if len(sys.argv) > 1 else str(ROOT / "build/site")
    if output.startswith("-"):
        sys.exit(f"{output}: no option is known here, and no folder is called so")
    gather()
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", output]  # --quiet counts no warning
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}  # docs/architecture.md
    built = subprocess.run(command, cwd=ROOT, env=environment, check=False, capture_output=True, text=True)
    if built.returncode:
        sys.stderr.write(built.stderr)
    sys.exit(built.returncode)


def gather() -> None:
    """Copy every page to its place in the site, with adapted links."""
    shutil.rmtree(PAGES, ignore_errors=True)
    places = {file: file.relative_to(DOCS) for pattern in STATIC for file in DOCS.rglob(pattern)}
    places |= {ROOT / name: Path(name) for name in TOP_PAGES}
    places[ROOT / "benchmarks/accuracy/trials.md"] = Path("trials.md")
    places[ROOT / "README.md"] = Path("index.md")
    for source, place in places.items():
        target = PAGES / place
        target.parent.mkdir(parents=True, exist_ok=True)
        if source.suffix == ".md":
            target.write_text(fitted(source, places), encoding="utf-8")
        else:
            shutil.copyfile(source, target)


def fitted(source: Path, places: dict[Path, Path]) -> str:
    """The text of one page with links that fit its place in the site."""

    def fit(link: re.Match[str]) -> str:
        target, hash_sign, anchor = link["target"].partition("#")
        if "://" in target or not target:
            return link[0]
        place = places.get((source.parent / target).resolve())
        if place is None:
            return link["words"]
        return f"{link['mark']}[{link['words']}]({os.path.relpath(place, places[source].parent)}{hash_sign}{anchor})"

    return with_formulas(LINK.sub(fit, source.read_text(encoding="utf-8")))


def with_formulas(text: str) -> str:
    """Markdown with formulas between dollar signs as MathML, except in code."""
    parts: list[str] = []
    end = 0
    for code in VERBATIM.finditer(text):
        parts += [FORMULA.sub(_as_mathml, text[end : code.start()]), code[0]]
        end = code.end()
    return "".join([*parts, FORMULA.sub(_as_mathml, text[end:])])


def _as_mathml(formula: re.Match[str]) -> str:
    if formula["block"]:
        return f"<p>{convert(formula['block'], display='block')}</p>"
    return f"<span>{convert(formula['inline'])}</span>"  # within a span, or a line that begins with it would be a block


if __name__ == "__main__":
    main()
