"""The command line, the web app and the written reports: the only place that knows viser and plotly."""
