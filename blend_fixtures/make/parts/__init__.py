"""What the fixture scripts share: the add-on, the person, the studio, the film."""
