"""The project's own numbers: records of commands that were run, and the pages written from them."""
