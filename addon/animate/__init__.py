"""The head's keys, set by an artist."""
