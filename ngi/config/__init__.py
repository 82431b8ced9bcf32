"""From a command line to objects: Hydra's configuration, its names and values, what it makes."""
