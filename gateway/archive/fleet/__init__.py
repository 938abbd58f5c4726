"""Analyses each vehicle in a fleet's data set: loads over time, refusals, drift, faulty sensors.

A data set's receipts go in, plain numbers with their numbers of batches come out; reports draw them.
"""
