"""Pairs of views or clouds of random rooms by overlap, to test the search for a pose and its verdict."""
