"""Verbs of the command line that stand on all the rooms, beside `ngi.train`."""
