"""The HTTP side: latest estimate, history, stream, status, health, metrics, dashboard.

The board supplies estimates, a reader the history, and a call the service's status; the web answers every client with a
token. ``create_app`` builds the application from access control, the live board and the routes.
"""
