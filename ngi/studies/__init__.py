"""What measures the program and is no part of it: nothing of the program imports it."""
