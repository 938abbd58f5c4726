"""The effect of the chosen constants: each is halved and doubled, on the same fresh vans.

``constants`` lists them and sets them temporarily, ``study`` calibrates and weighs with each and writes the page,
``changes`` finds the smallest detectable change of load.
"""
