"""The side that asks: clients of one worker and of several, their connections and calls."""
