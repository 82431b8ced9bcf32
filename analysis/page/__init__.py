"""The report as one HTML file that needs nothing else: no network, no scripts, no other file."""

from analysis.page.build import PageContents, write_page

__all__ = ["PageContents", "write_page"]
