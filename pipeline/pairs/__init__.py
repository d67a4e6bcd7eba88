"""Two clouds registered from the command line, by our methods and by peers."""
