"""Ends with 0 where the process at a port of this container is ready, else with 1 and what it waits for.

For health checks, which come every few seconds: it imports nothing of ours, so that it costs little.
"""

import http.client
import sys

PATIENCE = 3.0


def answer_of(port: int) -> tuple[int, str]:
    """What `/health/ready` says: the status and the body.

    Raises:
        OSError, http.client.HTTPException: nobody answers there.
    """
    connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
    try:
        connection.request("GET", "/health/ready")
        response = connection.getresponse()
        return response.status, response.read().decode(errors="replace")
    finally:
        connection.close()


def main(port: int) -> int:
    try:
        status, body = answer_of(port)
    except (OSError, http.client.HTTPException) as error:
        status, body = 0, f"nobody answers at port {port}: {error}"
    sys.stdout.write(body + "\n")
    return 0 if status == http.HTTPStatus.OK else 1


if __name__ == "__main__":
    sys.exit(main(int(sys.argv[1])))
