"""Registration of two clouds from the command line, by our methods and by peers."""
