"""From the clip to the head."""
