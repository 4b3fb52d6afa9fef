"""Facewright: from a filmed head to an animatable head."""

from .registration import register, unregister

__all__ = ["register", "unregister"]
