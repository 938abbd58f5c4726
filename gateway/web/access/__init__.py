"""Access control: tokens, TLS, limits of connections and requests, and security headers.

Requests with a valid token and of acceptable size go on to the routes; the others are answered with problem details.
Nothing here depends on the content of the requests.
"""
