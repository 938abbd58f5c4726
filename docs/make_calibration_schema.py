"""Writes docs/calibration.schema.json from the model that reads the file; --check only tells if it is up to date."""

import json
from pathlib import Path
from typing import Any, Final

from generated import keep_up_to_date
from pydantic.json_schema import GenerateJsonSchema

from gateway.calibration.file import CalibrationFile

PAGE = Path(__file__).with_name("calibration.schema.json")
DIALECT: Final = "https://json-schema.org/draft/2020-12/schema"
_ID: Final[dict[str, str]] = {
    "type": "string",
    "pattern": "^sha256:[0-9a-f]{64}$",
    "description": "sha256 of the canonical JSON (keys sorted, no spaces, ASCII) of everything but this id",
}


class _WithoutFieldTitles(GenerateJsonSchema):
    """Names say it already."""

    def field_title_should_be_set(self, schema: Any) -> bool:
        """Never."""
        return False


def calibration_schema() -> dict[str, Any]:
    """JSON Schema (draft 2020-12) of a file as `springscale calibrate` writes it: no key missing, none besides."""
    model = CalibrationFile.model_json_schema(mode="serialization", schema_generator=_WithoutFieldTitles)
    return {
        "$schema": DIALECT,
        **model,
        "title": "Springscale calibration file",
        "description": "What known-load drives taught of one vehicle. Units stand at the end of a name, "
        "unknown is null. Written by the tool, never by hand: the id is the hash of the content.",
        "properties": {"id": _ID, **model["properties"]},
        "required": ["id", *model["required"]],
    }


def schema_text() -> str:
    """The text of docs/calibration.schema.json."""
    return json.dumps(calibration_schema(), indent=1, ensure_ascii=False) + "\n"


def main() -> None:
    """Write the page, or compare it."""
    keep_up_to_date(PAGE, schema_text(), "gateway/calibration")


if __name__ == "__main__":
    main()
