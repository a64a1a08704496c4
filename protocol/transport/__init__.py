"""What both sides of a connection are made of: addresses, sockets, handshakes."""
