"""Several cameras at once: calibrated together, and one of them chosen for the clip."""
