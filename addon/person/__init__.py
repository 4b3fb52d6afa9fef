"""The person before the camera."""
