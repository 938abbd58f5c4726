"""The learner of a service: it keeps statements and drives, and learns the vehicle in a process of its own.

``Learner`` is the interface: the web calls it, the pipeline hands it every window, the gateway asks whether another
calibration is due. ``book`` owns learning.json and the calibrations named there, ``drives`` the kept windows,
``worker`` runs the process.
"""
