"""The vehicle as a model: from its parameters and its load to the spectra that its sensors should show.

parameters: the vector theta and what it stands for; half_car: heave and pitch on two axles; rolling_car: the same with
roll; usual_roll: how vehicles roll that nobody measured; friction: how rates go with amplitude; mount: where the
sensor sits; driven: responses at a group's speed and amplitude; expected: the spectral matrix of every group of
segments; slopes: how it changes with each parameter; matrix: such matrices, and how they are whitened.
"""
