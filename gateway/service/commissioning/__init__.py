"""Commissioning a vehicle on its own machine: its line, its weights, an empty drive, the fit, and the calibrations
made.

``Commissioning`` is the interface: the web calls its steps, the batch keeper reports every batch, the gateway asks
whether another calibration is due. It owns ``commissioning.json`` (``Record``), the calibrations named there, and the
folder ``lines``; the fit runs in a process of its own (``Worker``).
"""

from gateway.service.commissioning.book import OnEvent
from gateway.service.commissioning.desk import Commissioning, Drives
from gateway.service.commissioning.drive import Vehicle
from gateway.service.commissioning.jobs import Jobs
from gateway.service.commissioning.lines import Lines
from gateway.service.commissioning.start import commissioned, setup_in_use, why_not_allowed, with_commissioned

__all__ = [
    "Commissioning",
    "Drives",
    "Jobs",
    "Lines",
    "OnEvent",
    "Vehicle",
    "commissioned",
    "setup_in_use",
    "why_not_allowed",
    "with_commissioned",
]
