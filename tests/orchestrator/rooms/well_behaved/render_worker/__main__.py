from stand_in import render, run_worker, sample

from protocol.messages import Render, Role, SampleScene

run_worker(Role.RENDER, lambda: {SampleScene: sample, Render: render})
