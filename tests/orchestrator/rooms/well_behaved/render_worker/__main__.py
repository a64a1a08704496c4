from stand_in import render, sample, worker_options

from protocol import serve
from protocol.logs import configure
from protocol.messages import Render, Role, SampleScene

configure("render")
serve(lambda: {SampleScene: sample, Render: render}, role=Role.RENDER, bind=worker_options().bind)
