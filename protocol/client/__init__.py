"""The client's side: clients of one worker and of several, with their connections and calls."""
