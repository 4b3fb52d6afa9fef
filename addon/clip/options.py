"""Choices that the clip's properties and buttons share."""

# What a click on a frame of the strip does.
CLICKS = [
    ("FIRST", "First", "A click on a frame begins the part of the clip that is used"),
    ("LAST", "Last", "A click on a frame ends the part of the clip that is used"),
    ("OUT", "Leave Out", "A click leaves out the stretch that a frame stands for, or takes it in again"),
]
