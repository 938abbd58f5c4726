"""Commissioning a vehicle on its own machine: its weights, an empty drive, the fit, and the calibrations
made.

``Commissioning`` is the interface: the web calls its steps, the batch keeper reports every batch, the gateway asks
whether another calibration is due. It owns ``commissioning.json`` (``CommissioningRecord``), the calibrations named
there; the fit runs in a process of its own (``Worker``).
"""
