"""The service: one process, from the bus to the web, started, watched and stopped in one place.

Settings and their files (signal map, calibration) come in, and frames from the bus; estimates go out to the store, the
web and the uplink, and every change of state to the log and to systemd. It builds all parts and owns their threads.
"""

from gateway.service.gateway import Gateway, GatewayFailedError, OnStarted

__all__ = ["Gateway", "GatewayFailedError", "OnStarted"]
