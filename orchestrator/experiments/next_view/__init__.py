"""The experiment on the next view: which camera around the present one sees a person best (thesis, section 4.2).

`views.py` says what is seen, `observing.py` has the workers observe it, and `columns.py` is the table of it.
`perception_worker.next_view` chooses; `scores.py` tells how good its choices are, `page.py` and `plot.py` show it.
"""
