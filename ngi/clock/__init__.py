"""How long a run trains, and by which clock."""
