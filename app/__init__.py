"""The command line, the web app and the written reports. No other package imports viser or plotly."""
