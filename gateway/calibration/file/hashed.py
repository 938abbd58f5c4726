"""Versioned JSON files whose id is the hash of their content."""

import hashlib
import json
from pathlib import Path
from typing import Any, ClassVar, NamedTuple, TypeVar

from pydantic import ValidationError

from gateway.errors import CalibrationFileError
from gateway.stated.facts import Part
from gateway.toml_file import Read, describe_faults

Content = dict[str, Any]


class FileWords(NamedTuple):
    """The name of a kind of file, and how to make it again: in words, and by which command."""

    name: str
    again: str
    command: str


class HashedFile(Part):
    """The whole file except its id; a subclass has the fields ``format`` and ``version``."""

    words: ClassVar[FileWords]

    @property
    def id(self) -> str:
        """sha256 of the canonical JSON of everything in the file but the id itself; estimates name a calibration's."""
        return content_id(self.model_dump(mode="json"))

    def to_json(self) -> str:
        """The file's text, id first."""
        return json.dumps({"id": self.id, **self.model_dump(mode="json")}, indent=1, allow_nan=False) + "\n"


F = TypeVar("F", bound=HashedFile)


def content_id(content: Content) -> str:
    """sha256:... over the canonical JSON of ``content`` (keys sorted, no spaces), its own id left out."""
    rest = {key: part for key, part in content.items() if key != "id"}
    text = json.dumps(rest, sort_keys=True, separators=(",", ":"), allow_nan=False)
    return "sha256:" + hashlib.sha256(text.encode()).hexdigest()


def checked_file(path: Path, content: Content, model: type[F]) -> F:
    """A file's JSON as a ``model``, its format, version, hash and shape checked. Raises CalibrationFileError."""
    words, fields = model.words, model.model_fields
    if content.get("format") != fields["format"].default:
        raise CalibrationFileError(f"{path}: not a springscale {words.name} (format is {content.get('format')!r})")
    if content.get("version") != fields["version"].default:
        raise CalibrationFileError(
            f"{path}: {words.name} version {content.get('version')!r}, this springscale reads version "
            f"{fields['version'].default}: {words.again} with `{words.command}`"
        )
    if not _matches_its_id(content):
        raise CalibrationFileError(
            f"{path}: content does not match its id: the file was changed after it was written; restore it or "
            f"{words.again}"
        )
    try:
        return model.model_validate({key: part for key, part in content.items() if key != "id"})
    except CalibrationFileError as fault:
        raise CalibrationFileError(f"{path}: {fault}") from None
    except ValidationError as fault:
        raise CalibrationFileError(describe_faults(path, fault, model)) from None


def _matches_its_id(content: Content) -> bool:
    """False for a file that was changed since it was written."""
    try:
        return bool(content.get("id") == content_id(content))
    except ValueError:  # a number that is not finite, which is never written
        return False


def read_content(path: Path, read: Read) -> Content:
    """A file's JSON object. Raises CalibrationFileError if it is none."""
    try:
        content = json.loads(read(path).decode("utf-8"))
    except FileNotFoundError:
        raise CalibrationFileError(f"{path}: no such calibration file") from None
    except (OSError, UnicodeDecodeError) as fault:
        raise CalibrationFileError(f"{path}: cannot be read: {fault}") from None
    except (ValueError, RecursionError) as fault:  # a number of 5000 digits and brackets 5000 deep are no JSON for us
        raise CalibrationFileError(f"{path}: not valid JSON: {fault}") from None
    if not isinstance(content, dict):
        raise CalibrationFileError(f"{path}: not a springscale calibration file")
    return content
