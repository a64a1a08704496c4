"""What others may import from `protocol`; taking a name away breaks them."""

import protocol


def test_the_public_names_are_these():
    assert sorted(protocol.__all__) == [
        "Client",
        "Handlers",
        "Limits",
        "Pending",
        "Pool",
        "Statistics",
        "Timeouts",
        "Timing",
        "serve",
    ]


def test_every_public_name_is_there_and_says_what_it_is():
    for name in set(protocol.__all__) - {"Handlers"}:
        assert getattr(protocol, name).__doc__
