"""The training views of a learned lifter: of train identities, with a wider distribution than the test views."""
