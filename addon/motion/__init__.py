"""From tracks to a camera that moves with the clip, and points of the head."""
