"""`vantage/Grid-v0`: a walk on a grid around a person, on views that were taken before (thesis, sections 4.3.3 to 4.5).

`grid_map.py` is what there is to see, `walks.py` the rules of a step, `vector_grid.py` and `grid.py` the environments.
`drawing.py` draws a walk, `tables.py` finds the table that a configuration names.
"""
