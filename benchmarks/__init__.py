"""What is measured of the whole system, outside of the tests; each module is a command and says what it prints."""
