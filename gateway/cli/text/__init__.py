"""What commands say to people: records of the other rooms in, lines of text out.

One module for each thing that is told: a calibration file, an inspection, an estimate, a plan of loads to drive, the
[vehicle] block from axle weights. Nothing here computes; what is printed is the bar that
tells how far a long work is.
"""
