"""Who may come in, what a browser may send, and how text is made safe to show. Imports nothing else of
``app``."""
