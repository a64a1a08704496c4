from stand_in import perceive, worker_options

from protocol import serve
from protocol.logs import configure
from protocol.messages import Perceive, Role

configure("perception")
serve(lambda: {Perceive: perceive}, role=Role.PERCEPTION, bind=worker_options().bind)
