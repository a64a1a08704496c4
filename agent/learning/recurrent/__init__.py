"""Recurrent PPO: what `learner.algorithm = "recurrent_ppo"` learns with, on `vantage/Grid-v0` (thesis, section 4.3.6).

Read `lstm` (one layer over time, forwards and back), `network` (its layers and what follows), `policy` (acting with
it), `rollout` (the steps between two updates), `objective` and `update` (what improves the networks), and last
`recurrent_ppo`, the learner.
"""
