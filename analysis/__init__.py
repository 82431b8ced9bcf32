"""From the files that runs leave behind to tables, plots and pictures.

Reads files only: nothing of `ngi` is imported, so results can be reported where it is not
installed.
"""
