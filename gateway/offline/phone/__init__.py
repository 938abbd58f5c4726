"""Phones as sensors: a recording of an app becomes a log for every other command.

A zip of Sensor Logger or phyphox goes in (``recording``). ``quality`` finds the stretch in which the phone lay still
and whether it recorded the road, ``axes`` its orientation; a candump log with the signal map springscale:phone comes
out.
"""

from gateway.offline.phone.imported import Imported, import_recording, imported
from gateway.offline.phone.recording import read_recording

__all__ = ["Imported", "import_recording", "imported", "read_recording"]
