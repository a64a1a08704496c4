"""Tests whether a worker at an address keeps to the protocol. The worker may be written in any language.

    pytest --pyargs protocol.compliance --worker tcp://127.0.0.1:5555

Each test is one rule of docs/protocol.md; docs/compliance.md lists them. The suite uses a plain ZeroMQ socket, so that
a worker is tested against the protocol and not against Vantage's own client.
"""
