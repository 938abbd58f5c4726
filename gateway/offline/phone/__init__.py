"""Phones as sensors: what an app recorded becomes a log that every other command takes.

A zip of Sensor Logger or phyphox comes in (``recording``); where nobody moved the phone and how well it felt the road
is found (``quality``), then how it lay (``axes``); a candump log with the signal map springscale:phone goes out.
"""

from gateway.offline.phone.imported import PHONE_AXES, Imported, import_recording, imported
from gateway.offline.phone.recording import read_recording

__all__ = ["PHONE_AXES", "Imported", "import_recording", "imported", "read_recording"]
