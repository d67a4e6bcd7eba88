"""Computing processes, their job queue, the store of results, and the state of a session's results. Imports
nothing else of ``app``.
"""
