"""Commissioning a vehicle on its own machine: its line, its weights, an empty drive, the fit, and the calibrations
made.

``Commissioning`` is the interface: the web calls its steps, the batch keeper reports every batch, the gateway asks
whether another calibration is due. It owns ``commissioning.json`` (``CommissioningRecord``), the calibrations named
there, and the folder ``lines``; the fit runs in a process of its own (``Worker``).
"""

from gateway.service.commissioning.empty_drive import Jobs, ServiceVehicle
from gateway.service.commissioning.lines import Lines
from gateway.service.commissioning.session import Commissioning, DrivePosition
from gateway.service.commissioning.start import commissioned, setup_in_use, why_not_allowed, with_commissioned

__all__ = [
    "Commissioning",
    "DrivePosition",
    "Jobs",
    "Lines",
    "ServiceVehicle",
    "commissioned",
    "setup_in_use",
    "why_not_allowed",
    "with_commissioned",
]
