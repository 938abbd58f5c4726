"""Where a load lies across the vehicle: sought in what roll tells (``sought``), told beside payload and front share
(``told``), and where no roll rate tells, carried by the interval (``unseen``).
"""
