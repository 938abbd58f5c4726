"""Speed and memory of the product.

``python -m benchmarks.speed`` calls ``measure`` of each part, one after the other, and prints one table: ``decode`` and
``formats`` read logs beside others (``peers``), ``day`` estimates a working day, ``live`` receives, ``service`` is the
whole service and ``idle`` the parked one, ``web`` serves, ``weigh`` estimates and calibrates, ``archive`` reprocesses,
``start`` starts, ``simulator`` drives. Programs of their own are ``feed`` and
``soak``.
"""
