"""Sentences about a config: settings that change nothing in its runs."""
