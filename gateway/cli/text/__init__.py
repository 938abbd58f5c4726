"""The texts that commands print: records of the other rooms in, lines of text out.

One module for each subject: a calibration file, an inspection, an estimate, a plan of loads to drive, the [vehicle]
block from axle weights. Nothing here computes; the only thing printed here is the progress bar of a long task.
"""
