"""Parts of the config that fill a file of their own."""
