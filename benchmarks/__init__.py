"""Measurements of the product, run from a checkout: its speed and its accuracy. Never in the wheel."""
