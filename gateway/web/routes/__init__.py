"""The routes: one module a subject, each with its addresses and the shapes of its answers.

The live board, the store's reader and the service's status come in; a router a subject goes out, and the application
combines them. Here an estimate becomes weights, metrics, and the words of VSS and J1939.
"""
