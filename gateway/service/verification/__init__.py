"""Known weights, which condition later estimates, and verifications, which change nothing.

Each stated weight is attached to the load epoch of its time, which is read from the store. The dated records are kept
in one file per kind beside the database.
"""
