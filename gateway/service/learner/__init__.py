"""The learner of a service: it keeps statements and drives, and learns the vehicle in a process of its own.

The pipeline hands every window to ``Learner``. The web asks its parts: ``loads`` for statements, ``van`` for the
vehicle, ``learnt`` for what was learnt. ``learning_file`` owns learning.json and the calibrations named there,
``kept_drives`` the kept windows; ``worker`` runs the process.
"""
