"""The Export screen: results as files."""
