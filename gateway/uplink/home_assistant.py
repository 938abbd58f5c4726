"""MQTT device discovery for Home Assistant: the vehicle appears there without configuration.

One retained message describes the device and its entities. The weights are templates over the newest estimate, which is
retained under ``latest``, so they survive a restart of Home Assistant and stay visible while the vehicle is parked;
"Weighed" gives their time, "Connected" the presence of the vehicle. Format: "Device discovery payload" of
https://www.home-assistant.io/integrations/mqtt (Home Assistant 2024.11 and later).
"""

import hashlib
import json
from collections.abc import Mapping
from typing import Any, Final

from gateway.estimates.quantities import BY_NAME, QUANTITIES, Outward, Unit

LATEST: Final = "latest"  # topic of the newest estimate, retained
_SENSOR: Final[dict[Unit, dict[str, str]]] = {
    "kg": {"device_class": "weight", "unit_of_measurement": "kg"},
    "%": {"unit_of_measurement": "%"},
    "m": {"device_class": "distance", "unit_of_measurement": "m"},
}
_DIAGNOSTIC: Final = {"entity_category": "diagnostic"}
_OVERLOAD: Final = (
    "{{ 'None' if value_json.weights.gross.kg is none else "
    "'ON' if value_json.weights.values() | selectattr('is_over_limit') | list else 'OFF' }}"
)
_CONNECTED: Final = "{{ 'ON' if value_json.state == 'online' else 'OFF' }}"


def _measured(one: Outward, path: str, label: str) -> tuple[str, str, dict[str, Any]]:
    shown = {"platform": "sensor", "state_class": "measurement", "suggested_display_precision": one.digits}
    return label, f"{{{{ value_json.{path} }}}}", _SENSOR[one.unit] | shown


_STD: Final = _measured(BY_NAME["payload"], "payload_std_kg", "Payload standard deviation")
# Name, template, and attributes for Home Assistant. It shows None, an unknown number, as "unknown"
ENTITIES: Final[dict[str, tuple[str, str, dict[str, Any]]]] = {
    **{one.name: _measured(one, one.json_path, one.label) for one in QUANTITIES if one.label},
    "payload_std": (*_STD[:2], _STD[2] | _DIAGNOSTIC),
    "overload": ("Overload", _OVERLOAD, {"platform": "binary_sensor", "device_class": "problem"}),
    "weighed": ("Weighed", "{{ value_json.t_end }}", {"platform": "sensor", "device_class": "timestamp"}),
    "refused": (
        "Why not weighed",
        "{{ value_json.rejected | join(', ') }}",
        {"platform": "sensor", "state_topic": "estimates"} | _DIAGNOSTIC,
    ),
    "connected": (
        "Connected",
        _CONNECTED,
        {"platform": "binary_sensor", "device_class": "connectivity", "state_topic": "status"} | _DIAGNOSTIC,
    ),
}


def discovery(prefix: str, topic: str, birth: Mapping[str, Any]) -> tuple[str, str]:
    """Topic and JSON of the message; ``birth`` is the birth message of the vehicle."""
    vehicle = _object_id(str(birth["vehicle_id"]))
    device = {
        "identifiers": [f"springscale_{vehicle}"],
        "name": birth["vehicle_id"],
        "manufacturer": "Springscale",
        "serial_number": birth.get("vin"),
        "sw_version": birth.get("version"),
    }
    components = {
        key: {
            "name": name,
            "unique_id": f"springscale_{vehicle}_{key}",
            "value_template": template,
            **_below(topic, more),
        }
        for key, (name, template, more) in ENTITIES.items()
    }
    told = {
        "device": {key: known for key, known in device.items() if known is not None},
        "origin": {"name": "springscale", "sw_version": birth.get("version") or "unknown"},
        "components": components,
        "state_topic": f"{topic}/{LATEST}",
        "qos": 1,
    }
    return f"{prefix}/device/springscale_{vehicle}/config", json.dumps(told)


def _below(topic: str, more: Mapping[str, Any]) -> dict[str, Any]:
    """An entity with its own topic gets it below that of the vehicle."""
    return {**more, "state_topic": f"{topic}/{more['state_topic']}"} if "state_topic" in more else dict(more)


def _object_id(name: str) -> str:
    """A vehicle's id without dots, which are not allowed there; a changed id gets a hash, so that it stays unique."""
    safe = name.replace(".", "_")
    return safe if safe == name else f"{safe}_{hashlib.sha256(name.encode()).hexdigest()[:8]}"
