"""What holds for every test: a busy machine is no failure, so hypothesis's examples have no time limit."""

from hypothesis import settings

settings.register_profile("vantage", deadline=None)
settings.load_profile("vantage")
