"""Notebook-style examples of the library."""
