"""Rehearses disasters: trains once untouched and once under faults, and compares what came of it byte for byte.

Read `scenario.py` for what a fault is, `catalogue.py` for which there are, `rehearsal.py` for how they are played.
"""
