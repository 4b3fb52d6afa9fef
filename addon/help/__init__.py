"""The manual inside the extension, the report as a text, what to do first."""
