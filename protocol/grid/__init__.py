"""The grid of views around people, as the agent that walks on it and the orchestrator that builds it both know it.

`table.py` is a table's file, `named_tables.py` finds one by its name, `shipped/` has those that ship. `threshold.py`
says where a view is good enough, `paths.py` how far that is, `records.py` what came of an evaluation.
"""
