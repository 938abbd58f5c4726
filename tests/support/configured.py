"""springscale.toml of a service on a bus of the test's own."""

import json
from pathlib import Path


def service_config(folder: Path, calibration: str | None = None, more: str = "", **keys: str | float) -> Path:
    """Writes a configuration into ``folder`` and returns its path; ``calibration`` is the text of the file beside it.

    Keys are named with __ for the dot, as batch__window_s; ``more`` is further TOML.
    """
    told: dict[str, str | float] = {
        "signals": "springscale:reference",
        "bus__interface": "virtual",
        "bus__channel": folder.name,
        "web__port": 0,
        "store__directory": "state",
    }
    if calibration is not None:
        (folder / "vehicle.json").write_text(calibration)
        told["calibration"] = "vehicle.json"
    lines = [f"{key.replace('__', '.')} = {json.dumps(value)}" for key, value in (told | keys).items()]
    path = folder / "springscale.toml"
    path.write_text("\n".join([*lines, more, ""]))
    return path
