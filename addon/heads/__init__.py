"""The heads of a scene: listed, chosen, named, copied, removed, marked as assets."""
