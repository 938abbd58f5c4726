"""How fast the product is, and what it takes of memory: each module is a program that prints its figures.

``python -m benchmarks.speed.decode`` reads logs, ``live`` a bus, ``web`` serves, ``day`` estimates a working day,
``simulator`` drives, and ``soak`` runs the service through a simulated week.
"""
