"""The project's own numbers: records of commands that were run, and the pages that are written from them."""
