"""One probabilistic model of a vehicle, its drives and what is stated of their loads.

    fit(drives, prior)        the vehicle that these drives and statements teach
    weigh(batch, vehicle)     the load of one batch

Both maximise the same posterior: a drive is driven by a vehicle that deviates a little from the one of the table.
"""
