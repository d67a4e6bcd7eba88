"""Heavy work in processes next to the server, its results, and what a session has of them. Imports nothing
else of ``app``.
"""
