"""The camera: from board pictures, or from a file."""
