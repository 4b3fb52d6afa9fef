"""What the user prefers, for those who must not know where it is kept: the preferences set it."""

# Width and height of the texture of scenes that have chosen none, pixels.
texture_px = 2048
