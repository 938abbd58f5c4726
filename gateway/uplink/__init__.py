"""Forwarding of records to a fleet's MQTT broker and to a webhook: at least once and in order.

The store is the queue: senders follow its journal, deliver each record, and store the position they have reached. A
broken connection is opened again with growing pauses.
"""
