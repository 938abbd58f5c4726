"""How fast the product is, and what it takes of memory: each module is a program that prints its figures.

``python -m benchmarks.speed`` runs them one after the other into one table: ``decode`` and ``formats`` read logs
beside others (``peers``), ``day`` estimates a working day, ``live`` receives, ``service`` is the whole service, ``web``
serves, ``weigh`` estimates and calibrates, ``start`` starts, ``simulator`` drives. ``soak`` runs the service through a
simulated week.
"""
