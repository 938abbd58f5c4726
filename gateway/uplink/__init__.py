"""Estimates on their way to a fleet's MQTT broker: stored first, then forwarded, at least once and in order.

Pages of the stored history come in; messages to the broker go out, and how far they have come is remembered in the
store, which is the queue. A link that breaks is made again with growing pauses.
"""

from gateway.uplink.outbox import Outbox
from gateway.uplink.settings import UplinkSettings, uplink_settings
from gateway.uplink.uplink import Uplink

__all__ = ["Outbox", "Uplink", "UplinkSettings", "uplink_settings"]
