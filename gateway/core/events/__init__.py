"""Load events (what was loaded or unloaded, where and when) and trips (what was carried how far).

They are a pure function of the estimates (numbers, times, ways), so that the live service, a log and a restarted
service give the same events.
"""
