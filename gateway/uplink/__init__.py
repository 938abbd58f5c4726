"""Estimates on their way to a fleet's MQTT broker: stored first, then forwarded, at least once and in order."""

from gateway.uplink.outbox import Outbox
from gateway.uplink.settings import UplinkSettings, uplink_settings
from gateway.uplink.uplink import Uplink

__all__ = ["Outbox", "Uplink", "UplinkSettings", "uplink_settings"]
