"""The camera network: nodes, radio, sink. Headless; knows neither the app nor the pipeline."""
