"""Inspects an unknown log: its content, and whether it suffices to weigh a vehicle.

A log and databases go in; identifiers with their rates, the shipped signal maps that fit, the axis with gravity and a
draft of a signal map come out. Only the databases are trusted.
"""
