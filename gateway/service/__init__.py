"""The service: one process from the bus to the web. This package builds, starts, supervises and stops its parts.

Inputs are the settings with their files (signal map, calibration) and frames from the bus. Estimates go to the store,
the web and the uplink; every change of state goes to the log and to systemd.
"""
