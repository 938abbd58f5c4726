"""A vehicle learns from its ordinary drives and from statements of their loads, from logs as in a service.

    driven = pieces(drives, moments(records), settings)
    found = learn(vehicle, driven, matched(records, driven, vehicle), settings)

``drives`` cuts drives where statements begin and end, ``learn`` fits, ``told`` says what came of it as an object;
``job`` and ``work`` are the process in which a service learns.
"""
