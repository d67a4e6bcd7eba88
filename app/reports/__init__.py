"""The HTML and pictures that commands write; no display needed."""
