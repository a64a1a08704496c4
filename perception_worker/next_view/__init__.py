"""Which of the cameras around the present one will see a person best (thesis, section 4.2).

`arrays.py` reads a table of `orchestrator experiment next-view`. `classifiers.py` has the thesis's predictors, also
with a memory, `error_map.py` a map of the expected uncertainty around a person, and `baselines.py` what needs no
learning. All is fitted on the train scenes by `perceptron.py` (torch); `choices.py` writes what each way expects of
each camera.
"""
