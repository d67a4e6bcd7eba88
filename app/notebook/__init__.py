"""3-D views of results in Jupyter and marimo."""
