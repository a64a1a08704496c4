from stand_in import perceive, run_worker

from protocol.messages import Perceive, Role

run_worker(Role.PERCEPTION, lambda: {Perceive: perceive})
