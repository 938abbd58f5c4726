"""The weights of a vehicle on the road: gross, per axle and per wheel, and the place of its payload.

weighed(estimate, vehicle, unsprung)    # the estimate as published; ``unsprung`` comes from calibration
"""
