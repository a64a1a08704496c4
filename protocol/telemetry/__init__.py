"""A process's HTTP endpoints for monitors: liveness, readiness, information and metrics.

A process without `--http` serves none of them and needs none of the libraries. So import the modules that need FastAPI,
uvicorn or prometheus_client (`app`, `http`, `metrics`) only inside the functions that serve. See docs/metrics.md.
"""
