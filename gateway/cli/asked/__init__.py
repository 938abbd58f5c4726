"""Commands that ask a running service over HTTP: what it keeps is its own, and only it changes that.

Options say which service and with which token (``service``); its answers go out as JSON or as sentences.
"""
