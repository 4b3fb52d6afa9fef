"""From the clip to tracking markers, and back."""
