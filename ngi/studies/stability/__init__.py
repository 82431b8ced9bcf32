"""Extreme and stiff cases: what the program does where numbers vanish, overflow or never change."""
