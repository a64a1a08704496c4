"""Answers every ping, and no request."""

from bare_worker import open_worker

open_worker().serve(lambda worker, sender, number, message: None)
