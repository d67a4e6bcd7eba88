"""Access to the server, checks of what browsers send, and safe text. From ``app`` it imports nothing else."""
