"""The worker's side: its socket and I/O thread, the queue of jobs, and the registration with an orchestrator."""
