"""Blender's data to and from numpy. Axes and units are converted here and nowhere else."""
