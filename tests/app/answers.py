"""Jobs run to their end."""


def end(job):
    """What a job answers."""
    while True:
        try:
            next(job)
        except StopIteration as stop:
            return stop.value
