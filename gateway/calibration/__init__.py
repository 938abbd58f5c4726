"""Known-load drives in, a vehicle calibration file out, and an assessment of its accuracy.

A campaign file says which drives were recorded with which load (``campaign``); ``inspection`` checks them before any
fit, ``half_car`` and ``ratio_index`` fit one estimator each, ``sister`` makes a vehicle of the same
model the prior, ``calibrate`` writes the results into a ``file``, ``judgement`` compares its estimates with the truth.
``known_weights_file`` stores the weights that condition a calibrated vehicle's estimates. Each part exports its own
names: a running service reads files and never loads the code that fits them.
"""
