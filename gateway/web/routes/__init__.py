"""The routes: one module per subject, with its addresses and the models of its answers.

Each module makes a router from the live board, the store's reader, the service's status or one of its backends. The
routes also convert estimates to weights, metrics and VSS.
"""
