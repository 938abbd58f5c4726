"""A live CAN interface: the receiving thread, its bounded inbox, and the state of the bus.

An interface's name and the wanted identifiers come in; frames go out in order of arrival (``LiveSource``), with every
loss counted. After a bus error the thread waits and opens the bus again; it never dies.
"""
