"""Speed and memory of the product: each module is a program that prints its figures.

``python -m benchmarks.speed`` runs them in sequence into one table: ``decode`` and ``formats`` read logs beside others
(``peers``), ``day`` estimates a working day, ``live`` receives, ``service`` is the whole service, ``web`` serves,
``weigh`` estimates and calibrates, ``start`` starts, ``simulator`` drives. ``soak`` runs the service through a
simulated week.
"""
