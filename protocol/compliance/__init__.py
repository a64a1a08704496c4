"""Whether a worker at an address keeps to the protocol, in whatever language it is written.

    pytest --pyargs protocol.compliance --worker tcp://127.0.0.1:5555

Each test is one rule of docs/protocol.md; docs/compliance.md lists them. The suite has a bare ZeroMQ socket of its
own, so that no worker is judged by how well it gets on with our client.
"""
