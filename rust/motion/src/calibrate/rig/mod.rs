//! Several cameras at once.
