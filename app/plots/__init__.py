"""The figures: plotly for histograms, uPlot for curves."""
