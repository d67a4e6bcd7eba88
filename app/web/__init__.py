"""Access to the server, checks of what browsers send, and safe text. Imports nothing else of ``app``."""
