"""Springscale: weighs a vehicle by listening to its springs.

What a notebook needs is here by name (docs/api.md); each is imported when it is first asked for.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from gateway.calibration.file import CalibrationFile, load_calibration
    from gateway.core.batch_settings import BatchSettings
    from gateway.core.weights.limits import Limits
    from gateway.errors import SpringscaleError
    from gateway.estimates.as_json import estimate_to_json, table_row
    from gateway.estimates.batch_estimate import Estimate, Quantity
    from gateway.offline.estimates import estimate_arrays, estimates_of_logs
    from gateway.records import Spectra, Why
    from gateway.setup import Setup, load_setup

__all__ = (
    "BatchSettings",
    "CalibrationFile",
    "Estimate",
    "Limits",
    "Quantity",
    "Setup",
    "Spectra",
    "SpringscaleError",
    "Why",
    "estimate_arrays",
    "estimate_to_json",
    "estimates_of_logs",
    "load_calibration",
    "load_setup",
    "table_row",
)

_HOMES = {
    "BatchSettings": "gateway.core.batch_settings",
    "CalibrationFile": "gateway.calibration.file",
    "Estimate": "gateway.estimates.batch_estimate",
    "Limits": "gateway.core.weights.limits",
    "Quantity": "gateway.estimates.batch_estimate",
    "Setup": "gateway.setup",
    "Spectra": "gateway.records",
    "SpringscaleError": "gateway.errors",
    "Why": "gateway.records",
    "estimate_arrays": "gateway.offline.estimates",
    "estimate_to_json": "gateway.estimates.as_json",
    "estimates_of_logs": "gateway.offline.estimates",
    "load_calibration": "gateway.calibration.file",
    "load_setup": "gateway.setup",
    "table_row": "gateway.estimates.as_json",
}


def __getattr__(name: str) -> Any:
    """A public name, imported now (PEP 562)."""
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    found = globals()[name] = getattr(import_module(_HOMES[name]), name)
    return found


def __dir__() -> list[str]:
    """The public names too, for completion in a notebook."""
    return sorted({*globals(), *__all__})
