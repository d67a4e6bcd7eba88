"""Computing processes, their job queue, the store of results, and the state of a session's results.

Nothing here imports other parts of ``app``, except that the processes import the screens' jobs.
"""
