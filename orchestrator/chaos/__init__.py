"""Fault injection: trains once without faults and once under faults, and compares the results byte for byte.

Read `scenarios/scenario.py` for what a fault is, `scenarios/catalogue.py` for the list of faults, and `rehearsal.py`
for how they are injected.
"""
