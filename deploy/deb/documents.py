"""What Debian asks to be told in every package: its licence and those of its libraries, its changes, its exceptions."""

import gzip
import os
from datetime import UTC, datetime
from importlib.metadata import Distribution, distributions
from pathlib import Path
from typing import Final

HERE: Final = Path(__file__).resolve().parent

COPYRIGHT: Final = """\
Format: https://www.debian.org/doc/packaging-manuals/copyright-format/1.0/
Upstream-Name: Springscale
Comment: Every library in /usr/lib/springscale keeps its own licence, in the
 folder NAME-VERSION.dist-info beside it:
{libraries}

Files: *
Copyright: 2026 The Springscale founders
License: Apache-2.0

License: Apache-2.0
 The text is in /usr/share/common-licenses/Apache-2.0.
"""

CHANGELOG: Final = """\
{name} ({version}) unstable; urgency=medium

  * What changed is told in /usr/share/doc/springscale/CHANGELOG.md.

 -- The Springscale founders <maintainers@springscale.invalid>  {date}
"""


def document(root: Path, tree: Path, version: str) -> None:
    """What Debian asks of every package: copyright and changelog; and why it does some things in another way.

    The date is SOURCE_DATE_EPOCH of the environment.
    """
    documents, name = root / "usr/share/doc" / root.name, root.name
    documents.mkdir(parents=True, exist_ok=True)
    installed = sorted(distributions(path=[str(tree)]), key=normal_name)
    libraries = "\n".join(f"  {normal_name(found)} {found.version}: {licence_of(found)}" for found in installed)
    (documents / "copyright").write_text(COPYRIGHT.format(libraries=libraries))
    date = datetime.fromtimestamp(int(os.environ["SOURCE_DATE_EPOCH"]), UTC).strftime("%a, %d %b %Y %H:%M:%S +0000")
    write_gzipped(documents / "changelog.gz", CHANGELOG.format(name=name, version=version, date=date))
    overrides = root / "usr/share/lintian/overrides" / name
    overrides.parent.mkdir(parents=True)
    overrides.write_text((HERE / "lintian-overrides").read_text().format(name=name))


def licence_of(found: Distribution) -> str:
    """As the library's maker names it, in one short line."""
    fields = found.metadata
    licences = [text for text in fields.get_all("Classifier", []) if text.startswith("License")]
    classified = [text.rpartition(" :: ")[2] for text in licences]
    named = [*fields.get_all("License-Expression", []), *classified, *fields.get_all("License", []), "see there"]
    return str(named[0]).strip().splitlines()[0][:60]


def write_gzipped(path: Path, text: str) -> None:
    """The same text gives the same file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file, gzip.GzipFile("", "wb", fileobj=file, mtime=0) as packed:
        packed.write(text.encode())


def normal_name(found: Distribution) -> str:
    """Name as package indexes compare it."""
    return found.metadata["Name"].lower().replace("_", "-").replace(".", "-")
