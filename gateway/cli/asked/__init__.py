"""Commands that use a running service over HTTP: only the service itself changes its records.

Options name the service and its token (``service``); its answers are printed as JSON or as sentences.
"""
