"""A head taken elsewhere: GLB, FBX, USD and Alembic, with animation on every part."""
