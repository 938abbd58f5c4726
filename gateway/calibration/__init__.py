"""Known-load drives in, a vehicle calibration file out, and a judgement of how well it weighs.

A campaign file says which drives were recorded with which load (``campaign``); ``inspection`` looks at them before
anything is fitted, ``half_car`` and ``ratio_index`` learn one estimator each, ``line`` what sister vehicles
tell of the next one, ``calibrate`` puts what they learned
into a ``file``, ``judgement`` holds its answers against the truth and ``plan`` advises what to drive next.
``known_weights_file`` holds the weights that condition a calibrated vehicle's estimates. Each part hands out its own
names: a running service reads files and never loads what fits them.
"""
