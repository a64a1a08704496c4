"""How a process tells monitors how it is, over HTTP: whether it lives and is ready, what it is, and its metrics.

A process without `--http` serves nothing of this, and needs none of the libraries: import the modules here that need
FastAPI, uvicorn or prometheus_client (`app`, `http`, `metrics`) only where it is served. See docs/metrics.md.
"""
