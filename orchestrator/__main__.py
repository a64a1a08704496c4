"""`python -m orchestrator` is the `orchestrator` command."""

from orchestrator.cli.app import main

main()
