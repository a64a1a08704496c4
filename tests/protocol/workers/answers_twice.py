"""Answers every request twice, and the second time with the scene of another."""

from bare_worker import BareWorker, open_worker
from scenes import scene_for


def answer(worker: BareWorker, sender: bytes, number: int, message) -> None:
    worker.reply(sender, number, scene_for(message.seed))
    worker.reply(sender, number, scene_for(message.seed + 1000))


open_worker().serve(answer)
