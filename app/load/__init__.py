"""Load tests: many browsers at once on a real server, without pages (``bench --only load`` and ``soak``)."""
