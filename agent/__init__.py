"""Learns where to fly: environments, learners, baselines and evaluation."""
