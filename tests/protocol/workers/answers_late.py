"""Answers each request when the next one comes; its scene's yaw is the seed that it belongs to."""

from bare_worker import BareWorker, open_worker
from scenes import scene_for

held: list[tuple[bytes, int, int]] = []


def answer(worker: BareWorker, sender: bytes, number: int, message) -> None:
    held.append((sender, number, message.seed))
    if len(held) > 1:
        before, late, seed = held[-2]
        worker.reply(before, late, scene_for(seed))
        worker.reply(sender, number, scene_for(message.seed))


open_worker().serve(answer)
