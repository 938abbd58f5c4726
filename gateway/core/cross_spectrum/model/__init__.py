"""The vehicle as a model: from its parameters and its load to the spectra that its sensors should show.

parameters: the vector theta and what it stands for; half_car: heave and pitch on two axles; friction: how rates go with
amplitude; expected: the spectral matrix of every group of segments, and its slopes.
"""
