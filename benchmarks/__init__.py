"""Measurements of the product, run from a checkout: its speed and its accuracy. Never in the wheel."""

from gateway.model.allocator import keep_freed_memory

keep_freed_memory()  # as the command does
