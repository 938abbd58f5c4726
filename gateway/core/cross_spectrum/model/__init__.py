"""The vehicle model: from its parameters and its load to the expected spectra of its sensors.

parameters: the vector theta and its meaning; half_car: heave and pitch on two axles; rolling_car: the same with roll;
usual_roll: default roll parameters; friction: rates as functions of amplitude; reading: how spectra are computed, and
the sensor's place; driven: responses at a group's speed and amplitude; expected: the spectral matrix of every group of
segments; slopes: its derivatives by each parameter; matrix: such matrices, and their whitening.
"""
