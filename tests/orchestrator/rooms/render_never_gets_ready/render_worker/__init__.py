"""Answers pings and starts for ever."""
