"""Many browsers at once on a real server, without a page: what ``bench --only load`` and ``soak`` measure."""
