"""The table of a grid's views: from the centre of each cell around a person, observed once and walked on later.

`views.py` says what is seen, `observing.py` has the workers observe it, `table.py` makes the file that ships.
"""
