"""Filters of the states of all tracks at once. `bank.py` is their interface, `kalman.py` the usual one."""
