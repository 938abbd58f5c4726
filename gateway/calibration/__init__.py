"""Drives and statements in, a vehicle calibration file out, and an assessment of its accuracy.

A campaign file says which drives were recorded and what is known of their loads (``campaign``, ``statements``);
``inspection`` checks them before any fit, ``vehicle`` and ``ratio_index`` fit one estimator each, ``sister`` makes a
vehicle of the same model the prior, ``calibrate`` writes the results into a ``file``, ``judgement`` compares its
estimates with the truth, and ``ahead`` predicts what another drive or statement would gain.
``learning`` learns a vehicle from ordinary drives and from statements of their loads. Each part exports its own
names: a running service reads files and never loads the code that fits them.
"""
