"""The clip, chosen with the eyes."""
