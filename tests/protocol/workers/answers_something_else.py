"""Answers every request with a pong."""

from bare_worker import open_worker, pong

open_worker().serve(lambda worker, sender, number, message: worker.reply(sender, number, pong()))
