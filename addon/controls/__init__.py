"""Bones and handles that lead a head: optional, added and removed by a button."""
