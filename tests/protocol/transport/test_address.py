"""What is an address, and what is in the way of serving at one."""

import socket
from pathlib import Path

import pytest

from protocol.errors import AddressUnavailable
from protocol.transport.address import LONGEST_IPC_PATH, check_address, clear_stale_socket, ipc_path, reachable


@pytest.mark.parametrize(
    "address",
    [
        "tcp://127.0.0.1:5555",
        "tcp://gpu-box.local:1",
        "tcp://*:65535",
        "tcp://[::1]:5555",
        "ipc:///run/vantage/render-1",
        "ipc://relative",
    ],
)
def test_an_address_is_returned_as_it_is(address):
    assert check_address(address) == address


@pytest.mark.parametrize(
    "address",
    [
        "",
        "render-1",
        "tcp://",
        "tcp://host",
        "tcp://host:",
        "tcp://host:0",
        "tcp://host:65536",
        "tcp://host:port",
        "tcp://ho st:1",
        "inproc://x",
        "http://host:80",
        "TCP://host:80",
    ],
)
def test_what_is_no_address_is_named_and_told_how_to_write(address):
    with pytest.raises(AddressUnavailable, match=f"'{address}' is not an address; write tcp://host:port or ipc://"):
        check_address(address)


def test_an_ipc_address_names_a_socket():
    with pytest.raises(AddressUnavailable, match="ipc:// names no socket"):
        check_address("ipc://")


def test_a_path_that_the_system_does_not_take_is_told():
    fits = "/" + "x" * (LONGEST_IPC_PATH - 1)
    assert check_address(f"ipc://{fits}")
    with pytest.raises(AddressUnavailable, match="has a path of 104 bytes, the system takes 103"):
        check_address(f"ipc://{fits}x")


def test_the_length_of_a_path_is_counted_in_bytes():
    with pytest.raises(AddressUnavailable, match="has a path of 121 bytes"):
        check_address("ipc:///" + "ü" * 60)


def test_a_tcp_address_has_no_file():
    assert ipc_path("tcp://host:1") is None
    assert ipc_path("ipc:///a/b") == Path("/a/b")


def test_the_file_of_a_socket_without_a_listener_is_removed(address):
    path = Path(address.removeprefix("ipc://"))
    left = socket.socket(socket.AF_UNIX)
    left.bind(str(path))
    left.close()
    clear_stale_socket(address)
    assert not path.exists()


def test_a_socket_that_somebody_listens_at_stays(address):
    path = Path(address.removeprefix("ipc://"))
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(path))
        listening.listen()
        with pytest.raises(AddressUnavailable, match="is in use"):
            clear_stale_socket(address)
    assert path.exists()


def test_a_file_that_is_no_socket_stays(address):
    path = Path(address.removeprefix("ipc://"))
    path.write_text("precious")
    with pytest.raises(AddressUnavailable, match="is a file, not a socket"):
        clear_stale_socket(address)
    assert path.read_text() == "precious"


def test_nothing_in_the_way_is_nothing_to_clear(address):
    clear_stale_socket(address)
    clear_stale_socket("tcp://127.0.0.1:5555")


@pytest.mark.parametrize(
    ("bind", "address"),
    [
        ("tcp://0.0.0.0:5601", "tcp://gpu-box:5601"),
        ("tcp://*:5601", "tcp://gpu-box:5601"),
        ("tcp://[::]:5601", "tcp://gpu-box:5601"),
        ("tcp://10.0.0.7:5601", "tcp://10.0.0.7:5601"),
        ("tcp://127.0.0.1:5601", "tcp://127.0.0.1:5601"),
        ("ipc:///run/render-0", "ipc:///run/render-0"),
    ],
)
def test_who_binds_to_every_interface_is_reached_by_name(bind, address):
    assert reachable(bind, "gpu-box") == address
