"""The side that answers: a worker's socket, its queue of jobs, and its registration with an orchestrator."""
