"""The flight around a person as an environment: states, observations, rewards, and the workers' part in a step."""
