"""The lateral place of a load: estimated from roll (``sought``), with the roll share of the axles (``told``), or
without a roll rate as a part of the interval (``unseen``).
"""
